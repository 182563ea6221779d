// From the metaballs at a surface point to its colour: blending (thesis 3.1), the gradient normal
// and diffuse light (thesis 3.7).
#pragma once

#include <cstdint>

#include "metaball/density.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// Sums over the metaballs whose support holds the point.
struct SurfaceSums {
  float weight = 0.0f;     // F = sum f
  Vec3f color{};           // sum f C, linear light
  Vec3f outward{};         // -grad F, up to a factor
  float strongest = 0.0f;  // the largest f
  std::int32_t strongest_idx = -1;

  // offset: point minus centre; idx: the metaball's index in its cloud.
  SHERD_HD void Add(const Vec3f& offset, float inverse_radius, const Vec3f& linear_color,
                    std::int32_t idx) {
    const float inverse_r2 = inverse_radius * inverse_radius;
    const float q = 1.0f - Dot(offset, offset) * inverse_r2;
    if (!(q > 0.0f)) return;
    const float f = Murakami::Value(q);
    weight += f;
    color += linear_color * f;
    outward += offset * (Murakami::Derivative(q) * inverse_r2);
    if (f > strongest) {
      strongest = f;
      strongest_idx = idx;
    }
  }

  SHERD_HD Vec3f BlendedColor() const { return weight > 0.0f ? color * (1.0f / weight) : Vec3f{}; }
  // Unit normal towards the outside; where the gradient cancels, towards the viewer.
  SHERD_HD Vec3f Normal(const Vec3f& to_viewer) const { return Normalized(outward, to_viewer); }
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
