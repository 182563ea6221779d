// The metaballs a ray may see as they lie on the device, for the march of metaball/tile_march.h.
#pragma once

#include <cstdint>

#include "cuda/kernels/binning.h"
#include "cuda/kernels/device_ops.h"
#include "metaball/tile_entry.h"
#include "metaball/vec.h"

namespace sherd::kernels {

// What TileList has, over the device's arrays; what it lists is added below.
struct MetaballsInArrays {
  MetaballArrays metaballs;
  int count = 0;
  double uniform_threshold = 0.7;
  double threshold_scale = 1.0;

  SHERD_HD explicit MetaballsInArrays(const MetaballArrays& all)
      : metaballs(all),
        uniform_threshold(all.uniform_threshold),
        threshold_scale(all.threshold_scale) {}
  SHERD_HD Vec3f CenterOf(std::uint32_t i) const { return metaballs.sphere[i].center(); }
  template <class Real = float>
  SHERD_HD Real RadiusOf(std::uint32_t i) const {
    return static_cast<Real>(metaballs.sphere[i].radius) *
           static_cast<Real>(metaballs.radius_scale);
  }
  template <class Real = float>
  SHERD_HD Real ThresholdOf(std::uint32_t i) const {
    return metaballs.template ThresholdOf<Real>(i);
  }
};

// A screen tile's list.
struct ScreenTileList : MetaballsInArrays {
  const std::uint32_t* entry = nullptr;  // metaballs in depth order
  const std::uint32_t* front = nullptr;  // by metaball: OrderedBits of the front distance

  SHERD_HD ScreenTileList(const MetaballArrays& all, const std::uint32_t* own_entry, int own_count,
                          const std::uint32_t* all_fronts)
      : MetaballsInArrays(all), entry(own_entry), front(all_fronts) {
    count = own_count;
  }
  SHERD_HD std::uint32_t MetaballAt(int k) const { return entry[k]; }
  SHERD_HD float FrontAt(int k) const { return FloatFromOrdered(front[entry[k]]); }
};

// One ray's own list.
struct RayList : MetaballsInArrays {
  const TileEntry* entry = nullptr;  // nearest front first

  SHERD_HD RayList(const MetaballArrays& all, const TileEntry* own_entry, int own_count)
      : MetaballsInArrays(all), entry(own_entry) {
    count = own_count;
  }
  SHERD_HD std::uint32_t MetaballAt(int k) const { return entry[k].metaball; }
  SHERD_HD float FrontAt(int k) const { return entry[k].front; }
};

}  // namespace sherd::kernels
