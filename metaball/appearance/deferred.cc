#include "metaball/appearance/deferred.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "metaball/appearance/box_filter.h"
#include "metaball/appearance/gather.h"
#include "metaball/appearance/light_pass.h"
#include "metaball/appearance/pseudo_color.h"
#include "metaball/appearance/surface_pass.h"
#include "metaball/error.h"
#include "metaball/parallel.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"

namespace sherd {
namespace {

template <class T>
void AddOnce(const T& value, std::vector<T>* all) {
  if (std::find(all->begin(), all->end(), value) == all->end()) all->push_back(value);
}

// UV planes are found by their channel: one blend for each.
void AddUv(const TextureLookup& lookup, std::vector<UvRequest>* all) {
  if (lookup.coordinates == TextureCoordinates::kChannel) AddOnce(lookup.uv, all);
}

void CheckLookup(const TextureLookup& lookup, const Cloud& cloud, const std::string& what) {
  if (!lookup.image) throw Error(what + " has no image");
  if (lookup.coordinates == TextureCoordinates::kChannel) {
    ChannelNamed(cloud, lookup.uv.channel);
    return;
  }
  const TextureProjection& p = lookup.projection;
  if (!(p.size.x > 0) || !(p.size.y > 0) || !(p.size.z > 0) || !IsFinite(p.size) ||
      !IsFinite(p.center) || !IsFinite(p.right) || !IsFinite(p.up) || !IsFinite(p.forward)) {
    throw Error(what + "'s projection needs a box with a positive, finite size");
  }
}

void CheckLight(const Light& light) {
  const Vec3f& c = light.color;
  if (!(c.x >= 0) || !(c.y >= 0) || !(c.z >= 0) || !IsFinite(c) || !(light.intensity >= 0) ||
      !std::isfinite(light.intensity)) {
    throw Error("a light's colour and intensity must be finite and not negative");
  }
  if (light.kind == LightKind::kDirectional &&
      (!IsFinite(light.to_light) || !(Length(light.to_light) > 0))) {
    throw Error("a light's direction must be finite and not zero");
  }
  if (light.kind == LightKind::kPoint && !IsFinite(light.position)) {
    throw Error("a light's position must be finite");
  }
}

// Planes that only the passes wanted are given back.
void KeepPlanes(const Planes& wanted, Frame* frame) {
  if (!wanted.depth) frame->depth = {};
  if (!wanted.normal) frame->normal = {};
  if (!wanted.id) frame->id = {};
  if (!wanted.weight) frame->weight = {};
  if (!wanted.intensity) frame->intensity = {};
  if (!wanted.influence) frame->influence = {};
  // Those that were wanted come first, in their order.
  frame->channels.resize(wanted.channels.size());
  frame->uv.resize(wanted.uv.size());
}

// Colours and lights every hit of a frame whose colours are the blended ones; fills its light plane
// where it has one.
void ShadeFrame(const Scene& scene, const Camera& camera, int threads, const Control& control,
                Frame* frame) {
  const Appearance& appearance = scene.appearance;
  QuantityView quantity;
  TextureView texture;
  VolumeView volume;
  if (appearance.color == ColorSource::kQuantity) quantity = QuantityOf(scene, camera, *frame);
  if (appearance.color == ColorSource::kTexture) texture = TextureOf(appearance.texture, *frame);
  if (appearance.color == ColorSource::kVolume) volume = appearance.volume->view();
  const NormalView normals = NormalsOf(appearance, *frame);
  const LightPass light(scene, camera, *frame, threads, control);
  frame->stats.unresolved += light.unresolved();
  ParallelFor(frame->height, threads, [&](std::int64_t y, int) {
    control.ThrowIfStopped();
    for (int x = 0; x < frame->width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * frame->width + x;
      if (!(frame->depth[pixel] > 0.0f)) continue;
      const SurfaceHit point = SurfaceHitAt(camera, frame->depth.data(), frame->normal.data(),
                                            frame->width, x, static_cast<int>(y));
      const Vec3f normal = normals.NormalAt(point);
      Pixel& out = frame->color[pixel];
      Vec3f color{out.r, out.g, out.b};
      switch (appearance.color) {
        case ColorSource::kBlended:
          break;
        case ColorSource::kQuantity:
          color = quantity.ColorAt(pixel, point.position, normal);
          break;
        case ColorSource::kTexture:
          color = texture.ColorAt(point);
          break;
        case ColorSource::kVolume:
          color = volume.At(point.position);
          break;
      }
      const Vec3f factor = light.view().At(pixel, point.position, normal, point.to_viewer);
      if (!frame->light.empty()) frame->light[pixel] = factor;
      if (!scene.lighting.unlit) color = ColorInLight(color, factor);
      out = {color.x, color.y, color.z, out.a};
    }
  });
}

// The picture with a border of `reach` pixels more on every side, filtered, without the border.
Frame RenderFiltered(Renderer* renderer, const Scene& scene, const Camera& camera,
                     const RenderSettings& settings, const Control& control) {
  Scene unfiltered = scene;
  unfiltered.appearance.filter = 1;
  const int size = scene.appearance.filter, reach = size / 2;
  const int width = camera.width, height = camera.height;
  const Camera wider = camera.Cropped(-reach, -reach, width + 2 * reach, height + 2 * reach);
  Frame frame = renderer->Render(unfiltered, wider, settings, control);
  const Stopwatch watch;
  BoxFilter(frame.width, frame.height, size, &frame.color, settings.threads);
  const auto crop = [&](auto* plane, int components) {
    if (plane->empty()) return;
    const int row = width * components;
    for (int y = 0; y < height; ++y) {
      const auto from = plane->begin() +
                        (static_cast<std::ptrdiff_t>(y + reach) * frame.width + reach) * components;
      std::copy(from, from + row, plane->begin() + static_cast<std::ptrdiff_t>(y) * row);
    }
    plane->resize(static_cast<std::size_t>(row) * height);
  };
  crop(&frame.color, 1);
  crop(&frame.depth, 1);
  crop(&frame.normal, 1);
  crop(&frame.id, 1);
  crop(&frame.light, 1);
  crop(&frame.weight, 1);
  crop(&frame.intensity, 1);
  crop(&frame.influence, 1);
  for (ChannelPlane& plane : frame.channels) crop(&plane.values, plane.components);
  for (UvPlane& plane : frame.uv) crop(&plane.values, 1);
  frame.width = width;
  frame.height = height;
  frame.stats.seconds_total += watch.Seconds();
  return frame;
}

}  // namespace

bool NeedsDeferredPasses(const Scene& scene, const Planes& wanted) {
  const Appearance& a = scene.appearance;
  const bool lit = !scene.lighting.unlit;
  return wanted.light || a.color != ColorSource::kBlended || a.filter != 1 ||
         (lit &&
          (a.normal != NormalSource::kGradient || a.normal_map.source != NormalMapSource::kNone ||
           !a.lights.empty() || a.shadows.enabled || a.occlusion.enabled));
}

Planes PlanesNeeded(const Scene& scene, const Planes& wanted) {
  if (!NeedsDeferredPasses(scene, wanted)) return wanted;
  const Appearance& a = scene.appearance;
  Planes planes = wanted;
  planes.depth = planes.normal = true;
  if (a.shadows.enabled || a.occlusion.enabled) planes.id = true;
  if (a.normal == NormalSource::kInfluence) planes.influence = true;
  if (a.color == ColorSource::kQuantity) {
    if (a.pseudo.quantity == Quantity::kIntensity) planes.intensity = true;
    if (a.pseudo.quantity == Quantity::kField) planes.weight = true;
    if (a.pseudo.quantity == Quantity::kChannel) AddOnce(a.pseudo.channel, &planes.channels);
  }
  if (a.color == ColorSource::kTexture) AddUv(a.texture, &planes.uv);
  if (a.normal_map.source == NormalMapSource::kImage) AddUv(a.normal_map.lookup, &planes.uv);
  if (a.normal_map.source == NormalMapSource::kChannel) {
    AddOnce(a.normal_map.channel, &planes.channels);
  }
  return planes;
}

void CheckAppearance(const Scene& scene) {
  const Appearance& a = scene.appearance;
  if (!scene.cloud) throw Error("there is no cloud to render");
  const Cloud& cloud = *scene.cloud;
  CheckFilterSize(a.filter);
  if (a.color == ColorSource::kQuantity) {
    if (a.pseudo.quantity == Quantity::kChannel) ChannelNamed(cloud, a.pseudo.channel);
    if (a.pseudo.quantity == Quantity::kPosition &&
        (!IsFinite(a.pseudo.axis) || !(Length(a.pseudo.axis) > 0))) {
      throw Error("the axis of the colours must be finite and not zero");
    }
    if (!IsFinite(a.pseudo.point)) throw Error("the point of the colours must be finite");
  }
  if (a.color == ColorSource::kTexture) CheckLookup(a.texture, cloud, "the texture");
  if (a.color == ColorSource::kVolume) {
    if (!a.volume) throw Error("the three-dimensional texture has no voxels");
    a.volume->Validate();
  }
  if (a.normal_map.source == NormalMapSource::kImage) {
    CheckLookup(a.normal_map.lookup, cloud, "the normal map");
  }
  if (a.normal_map.source == NormalMapSource::kChannel &&
      ChannelNamed(cloud, a.normal_map.channel).components() != 3) {
    throw Error("channel '" + a.normal_map.channel +
                "' cannot hold normals: it has not 3 "
                "components");
  }
  for (const Light& light : a.lights) CheckLight(light);
  if (!(a.shadows.bias > 0) || !(a.occlusion.bias > 0) || !std::isfinite(a.shadows.bias) ||
      !std::isfinite(a.occlusion.bias)) {
    throw Error("the bias of shadows must be positive");
  }
  if (a.occlusion.directions < 4 || a.occlusion.directions > 1024) {
    throw Error("ambient occlusion takes 4 to 1024 directions");
  }
  if (!(a.occlusion.distance >= 0) || !std::isfinite(a.occlusion.distance)) {
    throw Error("the distance of ambient occlusion must not be negative");
  }
}

Frame RenderDeferred(Renderer* renderer, const Scene& scene, const Camera& camera,
                     const RenderSettings& settings, const Control& control) {
  CheckAppearance(scene);
  CheckRenderInput(scene, camera, settings);
  if (scene.appearance.filter > 1) {
    return RenderFiltered(renderer, scene, camera, settings, control);
  }
  if (settings.supersample > 1) {
    return RenderSupersampled(renderer, scene, camera, settings, control);
  }
  Scene plain = scene;
  plain.appearance = {};
  plain.lighting.unlit = true;
  RenderSettings all = settings;
  all.planes = PlanesNeeded(scene, settings.planes);
  all.planes.light = false;
  Frame frame = renderer->Render(plain, camera, all, control);
  if (settings.planes.light) frame.light.assign(frame.color.size(), {});
  const Stopwatch watch;
  if (!scene.cloud->empty()) ShadeFrame(scene, camera, settings.threads, control, &frame);
  KeepPlanes(settings.planes, &frame);
  frame.stats.seconds_trace += watch.Seconds();
  frame.stats.seconds_total += watch.Seconds();
  return frame;
}

}  // namespace sherd
