// A quantity at a surface point as a colour (thesis 3.2-3.4), on the CPU and on the GPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "metaball/appearance/appearance.h"
#include "metaball/appearance/color_map.h"
#include "metaball/color.h"
#include "metaball/hostdevice.h"
#include "metaball/morton.h"
#include "metaball/vec.h"

namespace sherd {

// A component of a channel's value, or for -1 the length of its vector.
SHERD_HD double ComponentOf(const float* v, int components, int component) {
  if (component >= 0) return v[component];
  double sum = 0;
  for (int k = 0; k < components; ++k) sum += static_cast<double>(v[k]) * v[k];
  return std::sqrt(sum);
}

// A PseudoColor (appearance.h) prepared for one frame. Of the planes only that of the quantity is
// read.
struct QuantityView {
  Quantity quantity = Quantity::kIntensity;
  ColorRange range;
  Vec3d axis{0, 0, 1};  // kPosition; unit
  Vec3d eye{};          // kCameraDistance; world
  Vec3d point{};        // kPointDistance; world
  Vec3d cube_min{};     // kMortonKey: the cube around the centres, world
  double cube_side = 1;
  int components = 1;  // kChannel: values a pixel
  int component = 0;   // of these; -1: the length of the vector
  ColorMapView map;
  const float* intensity = nullptr;  // by pixel
  const float* weight = nullptr;     // by pixel
  const float* channel = nullptr;    // `components` a pixel

  // Linear light. hit: world. normal: unit.
  SHERD_HD Vec3f ColorAt(std::size_t pixel, const Vec3d& hit, const Vec3f& normal) const {
    if (quantity == Quantity::kNormal) {
      return {Encoded(normal.x), Encoded(normal.y), Encoded(normal.z)};
    }
    return map.At((ValueAt(pixel, hit) - range.lo) / (range.hi - range.lo));
  }

 private:
  static constexpr int kMortonBits = 10;  // levels of the thesis's octree

  // As picture programs show normal maps: the encoded value is (n + 1) / 2.
  static SHERD_HD float Encoded(float v) {
    return LinearFromSrgb(std::clamp(0.5f * v + 0.5f, 0.0f, 1.0f));
  }

  // The cell of the cube along one axis; v: from the cube's lower side, world units.
  SHERD_HD std::uint32_t CellOf(double v) const {
    constexpr int kCells = 1 << kMortonBits;
    return static_cast<std::uint32_t>(
        std::clamp(v / cube_side * kCells, 0.0, static_cast<double>(kCells - 1)));
  }

  SHERD_HD double ValueAt(std::size_t pixel, const Vec3d& hit) const {
    switch (quantity) {
      case Quantity::kIntensity:
        return intensity[pixel];
      case Quantity::kField:
        return weight[pixel];
      case Quantity::kPosition:
        return Dot(hit, axis);
      case Quantity::kCameraDistance:
        return Length(hit - eye);
      case Quantity::kPointDistance:
        return Length(hit - point);
      case Quantity::kMortonKey: {
        const Vec3d p = hit - cube_min;
        return static_cast<double>(MortonKey63(CellOf(p.x), CellOf(p.y), CellOf(p.z))) /
               static_cast<double>((1u << 3 * kMortonBits) - 1);
      }
      case Quantity::kNormal:  // has no one value
      case Quantity::kChannel:
        break;
    }
    return ComponentOf(channel + pixel * components, components, component);
  }
};

}  // namespace sherd
