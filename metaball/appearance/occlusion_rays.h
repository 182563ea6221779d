// The rays of shadows and ambient occlusion from the surface points of a frame, on the CPU and on
// the GPU.
#pragma once

#include <cmath>
#include <cstddef>

#include "metaball/appearance/light_view.h"
#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// The points origin + t direction with begin <= t <= end, local units. end may be infinite.
struct OcclusionRay {
  Vec3d origin{}, direction{};  // direction of unit length
  double begin = 0, end = 0;
};

// A surface point that rays are cast from.
struct HitPoint {
  std::size_t pixel = 0;
  Vec3d position{};   // local units
  double radius = 0;  // of the metaball there, local units
};

// The hit of pixel (x, y). depth: the plane of a frame that is `width` pixels wide; > 0 there.
SHERD_HD HitPoint HitPointAt(const Camera& camera, const LocalFrame& local, const float* depth,
                             int width, int x, int y, double radius) {
  const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
  const double along = depth[pixel];
  const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
  return {pixel, local.LocalFromWorld(ray.origin + ray.direction * along), radius};
}

// From `bias` radii off the point to `reach` away from it.
SHERD_HD OcclusionRay RayFrom(const HitPoint& hit, const Vec3d& direction, double bias,
                              double reach) {
  return {hit.position, direction, bias * hit.radius, reach};
}

// A light that casts shadows, in local units.
struct ShadowLight {
  bool far = false;  // infinitely far away
  Vec3d place{};     // the unit direction towards the light, or its position

  // light: not at the viewer, who sees no shadows of it.
  static SHERD_HD ShadowLight Of(const PreparedLight& light, const LocalFrame& local) {
    if (light.kind == PreparedLight::Kind::kDirection) return {true, light.place};
    return {false, local.LocalFromWorld(light.place)};
  }

  // The ray from a hit towards the light. False where the surface is turned away from the light:
  // its shadow makes no difference. normal: the field's, unit. bias: Shadows::bias.
  SHERD_HD bool RayTo(const HitPoint& hit, const Vec3f& normal, double bias,
                      OcclusionRay* ray) const {
    const Vec3d to_light = far ? place : place - hit.position;
    if (!(Dot(normal.cast<double>(), to_light) > 0)) return false;
    if (far) {
      *ray = RayFrom(hit, to_light, bias, static_cast<double>(INFINITY));
    } else {
      const double distance = Length(to_light);
      *ray = RayFrom(hit, to_light / distance, bias, distance);
    }
    return true;
  }
};

// The weight of a direction in the ambient light of a surface: the cosine between them, 0 for those
// from below, which no ray is cast along. Both unit.
SHERD_HD float AmbientWeight(const Vec3f& normal, const Vec3d& direction) {
  const float cosine = Dot(normal, direction.cast<float>());
  return cosine > 0.0f ? cosine : 0.0f;
}

// The share of the ambient light that reaches a point, from the sums of the weights of all
// directions and of those that are shut.
SHERD_HD float AmbientShare(float shut, float all) { return all > 0.0f ? 1.0f - shut / all : 1.0f; }

}  // namespace sherd
