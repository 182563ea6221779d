// A metaball's colour as the kernels read it: r | g << 8 | b << 16, sRGB.
#pragma once

#include <cstdint>

#include "metaball/color.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd::kernels {

inline std::uint32_t PackColor(Rgb8 c) {
  return c.r | static_cast<std::uint32_t>(c.g) << 8 | static_cast<std::uint32_t>(c.b) << 16;
}

// Linear light. linear_from_srgb: 256 values.
SHERD_HD Vec3f UnpackColor(std::uint32_t c, const float* linear_from_srgb) {
  return {linear_from_srgb[c & 0xff], linear_from_srgb[c >> 8 & 0xff],
          linear_from_srgb[c >> 16 & 0xff]};
}

}  // namespace sherd::kernels
