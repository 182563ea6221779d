#include "metaball/appearance/light_pass.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "metaball/appearance/hit_groups.h"
#include "metaball/appearance/occlusion.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

constexpr double kEverywhere = std::numeric_limits<double>::infinity();

Vec3d InCamera(const Camera& camera, const Vec3d& v) {
  return camera.right * v.x + camera.down * v.y + camera.forward * v.z;
}

// The reach of ambient occlusion in local units.
double AmbientReach(const Scene& scene) {
  const Cloud& cloud = *scene.cloud;
  if (scene.appearance.occlusion.distance > 0) {
    return scene.appearance.occlusion.distance / cloud.frame.unit;
  }
  const Box3f box = cloud.CenterBox();
  const double reach = 0.1 * Length((box.max - box.min).cast<double>());
  return reach > 0 ? reach : cloud.RadiusOf(0);  // one metaball
}

}  // namespace

class LightPass::RayBatch {
 public:
  void Clear() {
    rays_.clear();
    pixels_.clear();
  }
  // From `bias` radii off the point to `reach` away from it.
  void Add(const HitPoint& hit, const Vec3d& direction, double bias, double reach) {
    rays_.push_back({hit.position, direction, bias * hit.radius, reach});
    pixels_.push_back(hit.pixel);
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
    : unlit_(scene.lighting.unlit),
      ambient_(static_cast<float>(scene.lighting.ambient)),
      diffuse_(static_cast<float>(scene.lighting.diffuse)) {
  if (unlit_) return;
  using Kind = PreparedLight::Kind;
  for (const Light& light : scene.appearance.lights) {
    PreparedLight prepared{Kind::kViewer};
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
    lights_.push_back(std::move(prepared));
  }
  if (lights_.empty()) {
    PreparedLight light{scene.lighting.headlight ? Kind::kViewer : Kind::kDirection};
    light.place = Normalized(scene.lighting.to_light);
    light.strength = {1, 1, 1};
    lights_.push_back(std::move(light));
  }
  if (scene.cloud->empty()) return;
  if (scene.appearance.shadows.enabled || scene.appearance.occlusion.enabled) {
    CastRays(scene, camera, frame, threads, control);
  }
}

void LightPass::CastRays(const Scene& scene, const Camera& camera, const Frame& frame, int threads,
                         const Control& control) {
  using Kind = PreparedLight::Kind;
  const Shadows& shadows = scene.appearance.shadows;
  const AmbientOcclusion& ambient = scene.appearance.occlusion;
  const LocalFrame& local = scene.cloud->frame;
  const Occlusion occlusion(scene, threads);
  if (shadows.enabled) {
    for (PreparedLight& light : lights_) {
      if (light.kind != Kind::kViewer) light.visible.assign(frame.color.size(), 1);
    }
  }
  std::vector<Vec3d> directions;
  if (ambient.enabled) {
    for (int k = 0; k < ambient.directions; ++k) {
      directions.push_back(FibonacciDirection(k, ambient.directions));
    }
    ambient_share_.assign(frame.color.size(), 1.0f);
  }
  const double reach = AmbientReach(scene);

  const auto cast_shadows = [&](const std::vector<HitPoint>& group, RayBatch* batch) {
    for (PreparedLight& light : lights_) {
      if (light.visible.empty()) continue;
      const Vec3d place = local.LocalFromWorld(light.place);
      batch->Clear();
      for (const HitPoint& hit : group) {
        const bool far = light.kind == Kind::kDirection;
        const Vec3d to_light = far ? light.place : place - hit.position;
        if (!(Dot(frame.normal[hit.pixel].cast<double>(), to_light) > 0)) continue;
        const double distance = far ? 1.0 : Length(to_light);
        batch->Add(hit, far ? to_light : to_light / distance, shadows.bias,
                   far ? kEverywhere : distance);
      }
      batch->Cast(occlusion, [&](std::size_t pixel) { light.visible[pixel] = 0; });
    }
  };
  // Cosine-weighted: the shares of the directions above the surface that are shut.
  const auto cast_ambient = [&](const std::vector<HitPoint>& group, RayBatch* batch) {
    std::vector<float>& share = ambient_share_;
    for (const HitPoint& hit : group) share[hit.pixel] = 0.0f;  // of what is shut, at first
    for (const Vec3d& direction : directions) {
      const auto cosine = [&](std::size_t pixel) {
        return Dot(frame.normal[pixel], direction.cast<float>());
      };
      batch->Clear();
      for (const HitPoint& hit : group) {
        if (cosine(hit.pixel) > 0.0f) batch->Add(hit, direction, ambient.bias, reach);
      }
      batch->Cast(occlusion, [&](std::size_t pixel) { share[pixel] += cosine(pixel); });
    }
    for (const HitPoint& hit : group) {
      float all = 0.0f;
      for (const Vec3d& direction : directions) {
        all += std::max(0.0f, Dot(frame.normal[hit.pixel], direction.cast<float>()));
      }
      share[hit.pixel] = all > 0.0f ? 1.0f - share[hit.pixel] / all : 1.0f;
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

Vec3f LightPass::Lit(std::size_t pixel, const Vec3f& color, const Vec3d& point, const Vec3f& normal,
                     const Vec3f& to_viewer) const {
  if (unlit_) return color;
  const float share = ambient_share_.empty() ? 1.0f : ambient_share_[pixel];
  Vec3f factor = Vec3f{1, 1, 1} * (ambient_ * share);
  for (const PreparedLight& light : lights_) {
    if (!light.visible.empty() && !light.visible[pixel]) continue;
    Vec3f to_light = to_viewer;
    if (light.kind == PreparedLight::Kind::kDirection) to_light = light.place.cast<float>();
    if (light.kind == PreparedLight::Kind::kPlace) {
      to_light = Normalized(light.place - point, normal.cast<double>()).cast<float>();
    }
    const float cosine = Dot(normal, to_light);
    if (cosine > 0.0f) factor += light.strength * (diffuse_ * cosine);
  }
  return {std::min(color.x * factor.x, 1.0f), std::min(color.y * factor.y, 1.0f),
          std::min(color.z * factor.z, 1.0f)};
}

}  // namespace sherd
