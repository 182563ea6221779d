// sRGB transfer (IEC 61966-2-1). Colours are stored sRGB-encoded in 8 bits, blended in linear
// light.
#pragma once

#include <cmath>
#include <cstdint>

#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// An sRGB-encoded colour, as photographs and PLY files hold it.
struct Rgb8 {
  std::uint8_t r = 0, g = 0, b = 0;
  friend bool operator==(const Rgb8&, const Rgb8&) = default;
};

// Encoded [0, 1] to linear [0, 1].
SHERD_HD float LinearFromSrgb(float v) {
  return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}
// Linear to encoded; values outside [0, 1] are clamped, NaN becomes 0.
SHERD_HD float SrgbFromLinear(float v) {
  if (!(v > 0.0f)) return 0.0f;
  if (v >= 1.0f) return 1.0f;
  return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
}
SHERD_HD std::uint8_t Quantize8(float v) {
  if (!(v > 0.0f)) return 0;
  if (v >= 1.0f) return 255;
  return static_cast<std::uint8_t>(v * 255.0f + 0.5f);
}

// 256 linear values, one for each encoded byte. Host only; built once, thread-safe.
const float* SrgbToLinearTable();

// table: 256 linear values, or a copy of them on a device.
SHERD_HD Vec3f LinearFromRgb8(Rgb8 c, const float* table) {
  return {table[c.r], table[c.g], table[c.b]};
}
inline Vec3f LinearFromRgb8(Rgb8 c) { return LinearFromRgb8(c, SrgbToLinearTable()); }
inline Rgb8 Rgb8FromLinear(const Vec3f& c) {
  return {Quantize8(SrgbFromLinear(c.x)), Quantize8(SrgbFromLinear(c.y)),
          Quantize8(SrgbFromLinear(c.z))};
}

}  // namespace sherd
