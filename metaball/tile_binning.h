// Sorting a frame's metaballs into screen tiles: each tile's list nearest first. Primary rays then
// need no spatial index, and radius, threshold or camera may change from frame to frame.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/control.h"
#include "metaball/tile_bounds.h"
#include "metaball/tile_entry.h"

namespace sherd {

inline constexpr int kTileSize = 8;  // pixels a side

// The lists of one frame. Buffers are kept between frames.
class TileBins {
 public:
  // The lists are the same for any number of threads. Throws Cancelled; ResourceError when they
  // would need more than 2^32 entries.
  void Build(const Cloud& cloud, float radius_scale, const ViewF& view, int threads,
             const Control& control);

  int tiles_x() const { return tiles_x_; }
  int tiles_y() const { return tiles_y_; }
  // A tile's pixels that the picture has.
  PixelBox PixelsOf(int tile) const {
    const int x0 = tile % tiles_x_ * kTileSize, y0 = tile / tiles_x_ * kTileSize;
    return {x0, y0, std::min(x0 + kTileSize, width_), std::min(y0 + kTileSize, height_)};
  }
  // The metaballs that a tile may see, nearest front first; fronts are >= 0.
  const TileEntry* list(int tile) const { return entries_.data() + begin_[tile]; }
  int count(int tile) const { return static_cast<int>(begin_[tile + 1] - begin_[tile]); }
  std::uint64_t metaballs_in_view() const { return metaballs_in_view_; }
  std::uint64_t entries() const { return begin_.empty() ? 0 : begin_.back(); }
  std::size_t MemoryBytes() const;

 private:
  struct TileBox {
    std::uint16_t x0, y0, x1, y1;  // half-open, in tiles
  };

  // Calls visit(tile, i) for every metaball i of [begin, end) and every tile it may touch.
  template <class Visit>
  void ForEachTile(std::size_t begin, std::size_t end, const Visit& visit) const;

  int width_ = 0, height_ = 0;  // pixels
  int tiles_x_ = 0, tiles_y_ = 0;
  std::uint64_t metaballs_in_view_ = 0;
  std::vector<float> front_;          // n
  std::vector<TileBox> box_;          // n; empty where out of view
  std::vector<std::uint32_t> next_;   // parts x tiles: counts, then where the next entry goes
  std::vector<std::uint32_t> begin_;  // tiles + 1
  std::vector<TileEntry> entries_;
};

}  // namespace sherd
