// Sorting a frame's metaballs into screen tiles: each tile's list nearest first. Primary rays then
// need no spatial index, and radius, threshold or camera may change from frame to frame.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/control.h"
#include "metaball/tile_bounds.h"

namespace sherd {

inline constexpr int kTileSize = 8;  // pixels a side

// The lists of one frame. Buffers are kept between frames.
class TileBins {
 public:
  // Throws Cancelled; ResourceError when the lists would need more than 2^32 entries.
  void Build(const Cloud& cloud, float radius_scale, const ViewF& view, int threads,
             const Control& control);

  int tiles_x() const { return tiles_x_; }
  int tiles_y() const { return tiles_y_; }
  // Indices into the cloud of the metaballs that tile may see, nearest front first.
  const std::uint32_t* list(int tile) const { return entries_.data() + begin_[tile]; }
  int count(int tile) const { return static_cast<int>(begin_[tile + 1] - begin_[tile]); }
  // By cloud index: a lower bound of the distance at which any ray enters it.
  const float* front() const { return front_.data(); }
  std::uint64_t metaballs_in_view() const { return order_.size(); }
  std::uint64_t entries() const { return begin_.empty() ? 0 : begin_.back(); }
  std::size_t MemoryBytes() const;

 private:
  struct TileBox {
    std::uint16_t x0, y0, x1, y1;  // half-open, in tiles
  };

  void SortByFront(int threads);

  int tiles_x_ = 0, tiles_y_ = 0;
  std::vector<float> front_;          // n
  std::vector<TileBox> box_;          // n
  std::vector<std::uint64_t> order_;  // front key and index of what is in view, nearest first
  std::vector<std::uint64_t> scratch_;
  std::vector<std::uint32_t> begin_;  // tiles + 1
  std::vector<std::uint32_t> entries_;
};

}  // namespace sherd
