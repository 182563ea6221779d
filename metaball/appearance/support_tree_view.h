// The boxes of a SupportTree and the beams that are asked of it, on the CPU and on the GPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// Rays that stay near an axis: each is at its parameter t, begin <= t <= end, no farther than
// `spread` from origin + t direction. Local units.
struct Beam {
  Vec3f origin, direction, inverse;  // inverse: 1 / direction, finite
  float spread = 0, begin = 0, end = 0;
};

// Boxes 16 i to 16 i + 15 are the children of box i one level up. Padded to full sixteens with
// boxes that no beam meets.
struct SupportTreeLevelView {
  const float *min_x = nullptr, *min_y = nullptr, *min_z = nullptr;
  const float *max_x = nullptr, *max_y = nullptr, *max_z = nullptr;
  std::size_t size = 0;  // boxes, with those of the padding
};

// A ball around the box of all supports.
inline void BallAround(const Vec3f& min, const Vec3f& max, Vec3d* middle, double* reach) {
  const Vec3d lo = min.cast<double>(), hi = max.cast<double>();
  *middle = (lo + hi) * 0.5;
  *reach = 0.5 * Length(hi - lo) * (1 + 1e-6);
}

// Members as in SupportTree (support_tree.h).
struct SupportTreeView {
  static constexpr int kWidth = 16;      // children of a box
  static constexpr int kMostLevels = 8;  // 16^8 metaballs are 2^32
  // The corners and centres of the padding, where no beam comes: squares of it are infinite.
  static constexpr float kNowhere = 1e30f;

  SupportTreeLevelView level[kMostLevels];
  int levels = 0;  // >= 1
  const float *x = nullptr, *y = nullptr, *z = nullptr, *radius = nullptr;
  const std::uint32_t* order = nullptr;  // null: the cloud's own
  std::size_t size = 0;                  // metaballs, with those of the padding
  Vec3d middle{};
  double reach = 0;

  // The index into the cloud of the tree's k-th metaball, which is none of the padding.
  SHERD_HD std::uint32_t IndexOf(std::size_t k) const {
    return order ? order[k] : static_cast<std::uint32_t>(k);
  }

  // The beam with what floats lose added to its spread. end may be infinite.
  SHERD_HD Beam BeamAlong(const Vec3d& origin, const Vec3d& direction, double spread, double begin,
                          double end) const {
    // What a beam's arithmetic in floats may lose, as a share of the coordinates.
    constexpr double kRounding = 2e-6;
    const double from_middle = Length(origin - middle);
    const double coordinates = Largest(origin) + Largest(middle) + reach + from_middle;
    const double slack = kRounding * coordinates;
    Beam beam;
    beam.origin = origin.cast<float>();
    beam.direction = direction.cast<float>();
    beam.inverse = {Inverse(direction.x), Inverse(direction.y), Inverse(direction.z)};
    beam.spread = static_cast<float>(spread * (1 + 1e-6) + slack);
    beam.begin = static_cast<float>(begin - slack);
    beam.end = static_cast<float>(std::min(end, from_middle + reach + spread) + slack);
    return beam;
  }

 private:
  static SHERD_HD float Inverse(double v) {
    constexpr double kLargest = 1e12;
    const double inverted = 1.0 / v;
    return static_cast<float>(std::abs(inverted) < kLargest ? inverted
                                                            : std::copysign(kLargest, v));
  }
  static SHERD_HD double Largest(const Vec3d& v) {
    return std::max(std::max(std::abs(v.x), std::abs(v.y)), std::abs(v.z));
  }
};

}  // namespace sherd
