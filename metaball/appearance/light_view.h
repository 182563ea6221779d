// Lights on a surface point (thesis 3.7 for each, summed, then clamped), on the CPU and on the GPU.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

struct PreparedLight {
  enum class Kind { kViewer, kDirection, kPlace };
  Kind kind = Kind::kViewer;
  Vec3d place{};  // world: the unit direction towards the light, or its position
  Vec3f strength{};
  const std::uint8_t* visible = nullptr;  // by pixel; null: everywhere
};

// A scene's light prepared for one frame.
struct LightView {
  bool unlit = false;
  float ambient = 0, diffuse = 0;
  const PreparedLight* light = nullptr;
  int lights = 0;
  const float* ambient_share = nullptr;  // by pixel; null: 1

  // ambient a + diffuse sum_i color_i intensity_i max(0, n . l_i) v_i, a and v_i the shares of
  // ambient light and of light i that reach the point; 1 in an unlit scene.
  SHERD_HD Vec3f At(std::size_t pixel, const Vec3d& point, const Vec3f& normal,
                    const Vec3f& to_viewer) const {
    if (unlit) return {1, 1, 1};
    const float share = ambient_share ? ambient_share[pixel] : 1.0f;
    Vec3f factor = Vec3f{1, 1, 1} * (ambient * share);
    for (int k = 0; k < lights; ++k) {
      const PreparedLight& from = light[k];
      if (from.visible && !from.visible[pixel]) continue;
      Vec3f to_light = to_viewer;
      if (from.kind == PreparedLight::Kind::kDirection) to_light = from.place.cast<float>();
      if (from.kind == PreparedLight::Kind::kPlace) {
        to_light = Normalized(from.place - point, normal.cast<double>()).cast<float>();
      }
      const float cosine = Dot(normal, to_light);
      if (cosine > 0.0f) factor += from.strength * (diffuse * cosine);
    }
    return factor;
  }
};

// A surface's own colour in this much light.
SHERD_HD Vec3f ColorInLight(const Vec3f& color, const Vec3f& light) {
  return {std::min(color.x * light.x, 1.0f), std::min(color.y * light.y, 1.0f),
          std::min(color.z * light.z, 1.0f)};
}

}  // namespace sherd
