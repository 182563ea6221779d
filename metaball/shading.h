// From the metaballs at a surface point to its colour: blending (thesis 3.1), the gradient normal
// and diffuse light (thesis 3.7).
#pragma once

#include <cstdint>

#include "metaball/density/shapes.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// Sums over the metaballs whose support holds the point. Colours are blended by the densities; a
// negative one (thesis 2.7) adds to the field and its gradient, but gives no colour.
struct SurfaceSums {
  float weight = 0.0f;            // sum of the positive f
  Vec3f color{};                  // sum f C, linear light
  Vec3f outward{};                // -grad sum f, up to a factor
  Vec3f outward_of_thresholds{};  // -grad sum f T_k, up to the same factor; blended thresholds only
  float strongest = -INFINITY;    // the largest f
  std::int32_t strongest_idx = -1;

  // offset: point minus centre; f, slope: the shape and its derivative by u there; inverse_r2: of
  // the support's radius; idx: the metaball's index in its cloud.
  SHERD_HD void Add(const Vec3f& offset, float f, float slope, float inverse_r2,
                    const Vec3f& linear_color, std::int32_t idx) {
    const float positive = f > 0.0f ? f : 0.0f;
    weight += positive;
    color += linear_color * positive;
    outward += offset * (-slope * inverse_r2);
    if (f > strongest) {
      strongest = f;
      strongest_idx = idx;
    }
  }

  // For blended thresholds, besides Add.
  SHERD_HD void AddThreshold(const Vec3f& offset, float slope, float inverse_r2, float threshold) {
    outward_of_thresholds += offset * (-slope * inverse_r2 * threshold);
  }

  SHERD_HD Vec3f BlendedColor() const { return weight > 0.0f ? color * (1.0f / weight) : Vec3f{}; }
  // Unit normal towards the outside; where the gradient cancels, towards the viewer.
  SHERD_HD Vec3f Normal(const Vec3f& to_viewer) const { return Normalized(outward, to_viewer); }
  // The same where thresholds are blended: F = A - B / A with A = sum f, B = sum f T_k has the
  // gradient 2 grad A - grad B / A where F = 0.
  SHERD_HD Vec3f BlendedNormal(const Vec3f& to_viewer) const {
    return Normalized(outward * (2.0f * weight) - outward_of_thresholds, to_viewer);
  }
};

// Lighting prepared for one frame (scene.h), in world axes.
struct FrameLight {
  float ambient = 0.0f, diffuse = 0.0f;
  Vec3f to_light{0.0f, 0.0f, 1.0f};
  bool unlit = false;
  bool headlight = false;  // the light is at the viewer
};

SHERD_HD Vec3f Shade(const FrameLight& light, const Vec3f& color, const Vec3f& normal,
                     const Vec3f& to_viewer) {
  if (light.unlit) return color;
  const float cosine = Dot(normal, light.headlight ? to_viewer : light.to_light);
  const float factor = light.ambient + light.diffuse * (cosine > 0.0f ? cosine : 0.0f);
  const Vec3f c = color * factor;
  return {c.x < 1.0f ? c.x : 1.0f, c.y < 1.0f ? c.y : 1.0f, c.z < 1.0f ? c.z : 1.0f};
}

}  // namespace sherd
