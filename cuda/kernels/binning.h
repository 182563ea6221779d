// From metaballs to sorted lists per screen tile. Each struct is one kernel: its fields are the
// launch's parameters, operator() the body for one thread index.
//
// The frame's order of work (frame_pipeline.h):
//   MeasureBounds   per metaball: pixel box, front distance as a sort key
//   (radix sort)    metaballs by front distance
//   CountTiles      per metaball in that order: tiles touched; the last one in view
//   (scan)          where each metaball's entries begin
//   FillEntries     entries (tile, metaball), written in depth order
//   (radix sort)    entries by tile, stable: inside a tile the depth order stays
//   FindRanges      where each tile's entries begin and end
// Sorting the metaballs by depth first and the entries by tile alone moves less memory than sorting
// the entries by (tile, depth): the entries, several for each metaball, take two or three passes
// over 8 bytes in place of six over 12.
#pragma once

#include <cstdint>

#include "cuda/kernels/device_ops.h"
#include "metaball/hostdevice.h"
#include "metaball/tile_bounds.h"
#include "metaball/vec.h"

namespace sherd::kernels {

inline constexpr int kTileSize = 8;                       // pixels along a tile's side
inline constexpr std::uint32_t kOutOfView = 0xffffffffu;  // sort key of a metaball in no tile
inline constexpr int kMaxRegionSide = 65528;  // pixel boxes are kept in 16 bits; whole tiles

// A PixelBox in 8 bytes.
struct alignas(8) PixelBox16 {
  std::uint16_t x0, y0, x1, y1;
};

// Centre and radius of a metaball, read at once.
struct alignas(16) Sphere {
  float x, y, z, radius;
  SHERD_HD Vec3f center() const { return {x, y, z}; }
};

// The metaballs on the device: what every kernel reads of the scene. Local units.
struct MetaballArrays {
  const Sphere* sphere = nullptr;  // radius_scale not yet applied
  double radius_scale = 1.0;
  std::uint32_t count = 0;
  // Where each has a threshold of its own; null: one for all. Not yet scaled.
  const float* threshold = nullptr;
  double uniform_threshold = 0.7;
  double threshold_scale = 1.0;  // 1 / the density's amplitude

  SHERD_HD float ScaledRadius(const Sphere& s) const {
    return s.radius * static_cast<float>(radius_scale);
  }
  // As TileList has it (metaball/tile_march.h).
  template <class Real = float>
  SHERD_HD Real ThresholdOf(std::uint32_t i) const {
    if (!threshold) return static_cast<Real>(uniform_threshold * threshold_scale);
    return static_cast<Real>(threshold[i]) * static_cast<Real>(threshold_scale);
  }
};

SHERD_HD std::uint32_t TileCount(const PixelBox16& box) {
  if (box.x0 >= box.x1) return 0;
  const std::uint32_t columns = (box.x1 - 1) / kTileSize - box.x0 / kTileSize + 1;
  const std::uint32_t rows = (box.y1 - 1) / kTileSize - box.y0 / kTileSize + 1;
  return columns * rows;
}

struct MeasureBounds {
  MetaballArrays metaballs;
  ViewF view;
  PixelBox16* box;       // n
  std::uint32_t* front;  // n: OrderedBits of the front distance, kOutOfView
  std::uint32_t* key;    // n: the same, to be sorted
  std::uint32_t* item;   // n: the index itself, the sort's payload

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::uint32_t i = static_cast<std::uint32_t>(thread);
    const Sphere sphere = metaballs.sphere[i];
    float distance = 0.0f;
    const PixelBox b =
        BoundsOfSphere(view, sphere.center(), metaballs.ScaledRadius(sphere), &distance);
    const bool seen = !b.empty();
    box[i] = seen ? PixelBox16{static_cast<std::uint16_t>(b.x0), static_cast<std::uint16_t>(b.y0),
                               static_cast<std::uint16_t>(b.x1), static_cast<std::uint16_t>(b.y1)}
                  : PixelBox16{0, 0, 0, 0};
    const std::uint32_t bits = seen ? OrderedBits(distance) : kOutOfView;
    front[i] = bits;
    key[i] = bits;
    item[i] = i;
  }
};

// What the host reads back after the scan.
struct BinTotals {
  std::uint64_t entries = 0;
  std::uint32_t in_view = 0;  // metaballs in at least one tile; they come first in depth order
  std::uint32_t padding = 0;
};

struct CountTiles {
  std::uint32_t count;         // metaballs
  const std::uint32_t* key;    // sorted
  const std::uint32_t* order;  // metaball at each place of the depth order
  const PixelBox16* box;
  std::uint32_t* tiles;  // count + 1; the last one 0, so that the scan's last value is the sum
  BinTotals* totals;     // zero before the launch

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::uint32_t i = static_cast<std::uint32_t>(thread);  // 0..count
    if (i == count) {
      tiles[i] = 0;
      return;
    }
    const bool seen = key[i] != kOutOfView;
    tiles[i] = seen ? TileCount(box[order[i]]) : 0;
    if (seen && (i + 1 == count || key[i + 1] == kOutOfView)) totals->in_view = i + 1;
  }
};

// Copies the scan's sum to where the host reads it with the rest.
struct TakeTotal {
  std::uint32_t count;
  const std::uint64_t* offset;  // count + 1
  BinTotals* totals;
  SHERD_HD void operator()(std::uint64_t) const { totals->entries = offset[count]; }
};

// One thread writes kEntriesPerThread consecutive entries: the work is even however many tiles a
// metaball touches. The first entry's metaball is found by bisection in the offsets.
struct FillEntries {
  static constexpr std::uint32_t kEntriesPerThread = 16;

  std::uint64_t entries;
  std::uint32_t in_view;
  int tiles_x;
  const std::uint64_t* offset;  // in depth order
  const std::uint32_t* order;
  const PixelBox16* box;
  std::uint32_t* tile;      // entries
  std::uint32_t* metaball;  // entries

  static std::uint64_t Threads(std::uint64_t entries) {
    return (entries + kEntriesPerThread - 1) / kEntriesPerThread;
  }

  SHERD_HD void operator()(std::uint64_t thread) const {
    std::uint64_t e = thread * kEntriesPerThread;
    const std::uint64_t end = e + kEntriesPerThread < entries ? e + kEntriesPerThread : entries;
    // The last place whose offset is <= e: places in view have at least one entry each.
    std::uint32_t lo = 0, hi = in_view;
    while (hi - lo > 1) {
      const std::uint32_t middle = lo + (hi - lo) / 2;
      if (offset[middle] <= e) {
        lo = middle;
      } else {
        hi = middle;
      }
    }
    std::uint32_t place = lo;
    while (e < end) {
      const std::uint32_t i = order[place];
      const PixelBox16 b = box[i];
      const std::uint32_t first_column = b.x0 / kTileSize;
      const std::uint32_t columns = (b.x1 - 1) / kTileSize - first_column + 1;
      const std::uint32_t nth = static_cast<std::uint32_t>(e - offset[place]);
      std::uint32_t row = b.y0 / kTileSize + nth / columns;
      std::uint32_t column = nth % columns;
      const std::uint64_t stop = offset[place + 1] < end ? offset[place + 1] : end;
      for (; e < stop; ++e) {
        tile[e] = row * static_cast<std::uint32_t>(tiles_x) + first_column + column;
        metaball[e] = i;
        if (++column == columns) {
          column = 0;
          ++row;
        }
      }
      ++place;
    }
  }
};

// Half-open range of entries; equal for a tile without any.
struct EntryRange {
  std::uint32_t begin, end;
};

struct FindRanges {
  std::uint64_t entries;
  const std::uint32_t* tile;  // sorted
  EntryRange* range;          // one for each tile, zero before the launch

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::uint32_t e = static_cast<std::uint32_t>(thread);
    const std::uint32_t here = tile[e];
    if (e == 0 || tile[e - 1] != here) range[here].begin = e;
    if (e + 1 == entries || tile[e + 1] != here) range[here].end = e + 1;
  }
};

}  // namespace sherd::kernels
