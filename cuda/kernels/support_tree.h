// The tree of boxes of metaball/appearance/support_tree.h, built where it is used: leaves of
// sixteen metaballs first, then level by level upwards.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/kernels/binning.h"
#include "metaball/appearance/support_tree_view.h"
#include "metaball/hostdevice.h"

namespace sherd::kernels {

// The six arrays of a level, one after another.
struct TreeBoxes {
  float* bounds = nullptr;  // min x, y, z, max x, y, z; `size` each
  std::size_t size = 0;     // boxes, whole sixteens

  SHERD_HD void Set(std::size_t i, const Vec3f& min, const Vec3f& max) const {
    const float values[6] = {min.x, min.y, min.z, max.x, max.y, max.z};
    for (int k = 0; k < 6; ++k) bounds[k * size + i] = values[k];
  }
  SHERD_HD Vec3f Min(std::size_t i) const {
    return {bounds[i], bounds[size + i], bounds[2 * size + i]};
  }
  SHERD_HD Vec3f Max(std::size_t i) const {
    return {bounds[3 * size + i], bounds[4 * size + i], bounds[5 * size + i]};
  }
  SupportTreeLevelView view() const {
    return {bounds,
            bounds + size,
            bounds + 2 * size,
            bounds + 3 * size,
            bounds + 4 * size,
            bounds + 5 * size,
            size};
  }
};

// One thread a leaf, those of the padding too.
struct PlaceLeaves {
  MetaballArrays metaballs;
  const std::uint32_t* order;  // may be null
  float *x, *y, *z, *radius;   // whole sixteens
  TreeBoxes boxes;

  SHERD_HD void operator()(std::uint64_t leaf) const {
    constexpr float kNowhere = SupportTreeView::kNowhere;
    constexpr std::uint64_t kWidth = SupportTreeView::kWidth;
    const std::uint64_t first = leaf * kWidth;
    if (first >= metaballs.count) {
      boxes.Set(leaf, {kNowhere, kNowhere, kNowhere}, {kNowhere, kNowhere, kNowhere});
      return;
    }
    Vec3f lo{INFINITY, INFINITY, INFINITY}, hi{-INFINITY, -INFINITY, -INFINITY};
    for (std::uint64_t k = first; k < first + kWidth; ++k) {
      if (k >= metaballs.count) {
        x[k] = y[k] = z[k] = kNowhere;
        radius[k] = 0.0f;
        continue;
      }
      const Sphere s = metaballs.sphere[order ? order[k] : k];
      const auto r = static_cast<float>(s.radius * metaballs.radius_scale * (1 + 1e-6));
      x[k] = s.x;
      y[k] = s.y;
      z[k] = s.z;
      radius[k] = r;
      lo = {fminf(lo.x, s.x - r), fminf(lo.y, s.y - r), fminf(lo.z, s.z - r)};
      hi = {fmaxf(hi.x, s.x + r), fmaxf(hi.y, s.y + r), fmaxf(hi.z, s.z + r)};
    }
    boxes.Set(leaf, lo, hi);
  }
};

// One thread a box, those of the padding too.
struct PlaceBoxes {
  TreeBoxes below;
  std::uint64_t count_below;  // without the padding
  TreeBoxes boxes;

  SHERD_HD void operator()(std::uint64_t box) const {
    constexpr float kNowhere = SupportTreeView::kNowhere;
    constexpr std::uint64_t kWidth = SupportTreeView::kWidth;
    const std::uint64_t first = box * kWidth;
    Vec3f lo{kNowhere, kNowhere, kNowhere}, hi = lo;
    for (std::uint64_t k = first; k < first + kWidth && k < count_below; ++k) {
      const Vec3f a = below.Min(k), b = below.Max(k);
      if (k == first) {
        lo = a;
        hi = b;
      }
      lo = {fminf(lo.x, a.x), fminf(lo.y, a.y), fminf(lo.z, a.z)};
      hi = {fmaxf(hi.x, b.x), fmaxf(hi.y, b.y), fmaxf(hi.z, b.z)};
    }
    boxes.Set(box, lo, hi);
  }
};

}  // namespace sherd::kernels
