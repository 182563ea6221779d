#include "metaball/appearance/light_pass.h"

#include <cstddef>

#include "metaball/appearance/hit_groups.h"
#include "metaball/appearance/occlusion.h"
#include "metaball/appearance/occlusion_rays.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

Vec3d InCamera(const Camera& camera, const Vec3d& v) {
  return camera.right * v.x + camera.down * v.y + camera.forward * v.z;
}

}  // namespace

std::vector<PreparedLight> PrepareLights(const Scene& scene, const Camera& camera) {
  using Kind = PreparedLight::Kind;
  std::vector<PreparedLight> lights;
  if (scene.lighting.unlit) return lights;
  for (const Light& light : scene.appearance.lights) {
    PreparedLight prepared;
    prepared.strength = light.color * static_cast<float>(light.intensity);
    if (light.kind == LightKind::kDirectional) {
      prepared.kind = Kind::kDirection;
      prepared.place =
          Normalized(light.with_camera ? InCamera(camera, light.to_light) : light.to_light);
    } else if (light.kind == LightKind::kPoint) {
      prepared.kind = Kind::kPlace;
      prepared.place =
          light.with_camera ? camera.eye + InCamera(camera, light.position) : light.position;
    }
    lights.push_back(prepared);
  }
  if (lights.empty()) {
    PreparedLight light;
    light.kind = scene.lighting.headlight ? Kind::kViewer : Kind::kDirection;
    light.place = Normalized(scene.lighting.to_light);
    light.strength = {1, 1, 1};
    lights.push_back(light);
  }
  return lights;
}

LightView MakeLightView(const Scene& scene, const std::vector<PreparedLight>& lights) {
  LightView view;
  view.unlit = scene.lighting.unlit;
  view.ambient = static_cast<float>(scene.lighting.ambient);
  view.diffuse = static_cast<float>(scene.lighting.diffuse);
  view.light = lights.data();
  view.lights = static_cast<int>(lights.size());
  return view;
}

std::vector<Vec3d> AmbientDirections(const AmbientOcclusion& occlusion) {
  std::vector<Vec3d> directions;
  if (!occlusion.enabled) return directions;
  for (int k = 0; k < occlusion.directions; ++k) {
    directions.push_back(FibonacciDirection(k, occlusion.directions));
  }
  return directions;
}

double AmbientReach(const Scene& scene) {
  const Cloud& cloud = *scene.cloud;
  if (scene.appearance.occlusion.distance > 0) {
    return scene.appearance.occlusion.distance / cloud.frame.unit;
  }
  const Box3f box = cloud.CenterBox();
  const double reach = 0.1 * Length((box.max - box.min).cast<double>());
  return reach > 0 ? reach : cloud.RadiusOf(0);  // one metaball
}

class LightPass::RayBatch {
 public:
  void Clear() {
    rays_.clear();
    pixels_.clear();
  }
  void Add(std::size_t pixel, const OcclusionRay& ray) {
    rays_.push_back(ray);
    pixels_.push_back(pixel);
  }
  // Calls visit(pixel) for every ray that meets the surface.
  template <class Visit>
  void Cast(const Occlusion& occlusion, const Visit& visit) {
    occluded_.resize(rays_.size());
    occlusion.Cast(rays_.data(), static_cast<int>(rays_.size()), &scratch_, occluded_.data());
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      if (occluded_[i]) visit(pixels_[i]);
    }
  }
  std::uint64_t unresolved() const { return scratch_.counts.unresolved; }

 private:
  std::vector<OcclusionRay> rays_;
  std::vector<std::size_t> pixels_;
  std::vector<std::uint8_t> occluded_;
  Occlusion::Scratch scratch_;
};

LightPass::LightPass(const Scene& scene, const Camera& camera, const Frame& frame, int threads,
                     const Control& control)
    : lights_(PrepareLights(scene, camera)), view_(MakeLightView(scene, lights_)) {
  if (scene.lighting.unlit || scene.cloud->empty()) return;
  if (scene.appearance.shadows.enabled || scene.appearance.occlusion.enabled) {
    CastRays(scene, camera, frame, threads, control);
  }
}

void LightPass::CastRays(const Scene& scene, const Camera& camera, const Frame& frame, int threads,
                         const Control& control) {
  const Shadows& shadows = scene.appearance.shadows;
  const AmbientOcclusion& ambient = scene.appearance.occlusion;
  const LocalFrame& local = scene.cloud->frame;
  const Occlusion occlusion(scene, threads);
  visible_.resize(lights_.size());
  if (shadows.enabled) {
    for (std::size_t k = 0; k < lights_.size(); ++k) {
      if (lights_[k].kind == PreparedLight::Kind::kViewer) continue;
      visible_[k].assign(frame.color.size(), 1);
      lights_[k].visible = visible_[k].data();
    }
  }
  const std::vector<Vec3d> directions = AmbientDirections(ambient);
  if (ambient.enabled) {
    ambient_share_.assign(frame.color.size(), 1.0f);
    view_.ambient_share = ambient_share_.data();
  }
  const double reach = AmbientReach(scene);

  const auto cast_shadows = [&](const std::vector<HitPoint>& group, RayBatch* batch) {
    for (std::size_t k = 0; k < lights_.size(); ++k) {
      std::vector<std::uint8_t>& visible = visible_[k];
      if (visible.empty()) continue;
      const ShadowLight light = ShadowLight::Of(lights_[k], local);
      batch->Clear();
      OcclusionRay ray;
      for (const HitPoint& hit : group) {
        if (!light.RayTo(hit, frame.normal[hit.pixel], shadows.bias, &ray)) continue;
        batch->Add(hit.pixel, ray);
      }
      batch->Cast(occlusion, [&](std::size_t pixel) { visible[pixel] = 0; });
    }
  };
  const auto cast_ambient = [&](const std::vector<HitPoint>& group, RayBatch* batch) {
    std::vector<float>& share = ambient_share_;
    const auto weight = [&](std::size_t pixel, const Vec3d& direction) {
      return AmbientWeight(frame.normal[pixel], direction);
    };
    for (const HitPoint& hit : group) share[hit.pixel] = 0.0f;  // of what is shut, at first
    for (const Vec3d& direction : directions) {
      batch->Clear();
      for (const HitPoint& hit : group) {
        if (!(weight(hit.pixel, direction) > 0.0f)) continue;
        batch->Add(hit.pixel, RayFrom(hit, direction, ambient.bias, reach));
      }
      batch->Cast(occlusion, [&](std::size_t pixel) { share[pixel] += weight(pixel, direction); });
    }
    for (const HitPoint& hit : group) {
      float all = 0.0f;
      for (const Vec3d& direction : directions) all += weight(hit.pixel, direction);
      share[hit.pixel] = AmbientShare(share[hit.pixel], all);
    }
  };
  std::vector<RayBatch> batches(static_cast<std::size_t>(ThreadCount(threads)));
  ForEachHitGroup(scene, camera, frame, threads, control,
                  [&](const std::vector<HitPoint>& group, int worker) {
                    RayBatch* batch = &batches[static_cast<std::size_t>(worker)];
                    if (shadows.enabled) cast_shadows(group, batch);
                    if (ambient.enabled) cast_ambient(group, batch);
                  });
  for (const RayBatch& batch : batches) unresolved_ += batch.unresolved();
}

}  // namespace sherd
