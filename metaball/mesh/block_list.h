// Which metaballs reach which blocks of the extraction grid. Internal to metaball/mesh/.
//
// Grid nodes lie at the integer multiples of the cell size, in local units. Block (x, y, z) owns
// the kBlockCells^3 cells from node kBlockCells * (x, y, z) on. Only blocks that a support reaches
// exist.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "metaball/control.h"
#include "metaball/mesh/mesh_field.h"

namespace sherd {

inline constexpr int kBlockCells = 16;

class BlockList {
 public:
  // Throws Error when the blocks or their entries are too many to count.
  BlockList(const MeshField& field, const Cloud& cloud, double cell, const Control& control);

  std::size_t size() const { return keys_.size(); }
  // The block's place in units of blocks.
  std::array<std::int64_t, 3> PlaceOf(std::size_t block) const;
  // The metaballs whose supports reach the closed block, in ascending order.
  std::span<const std::uint32_t> MetaballsOf(std::size_t block) const {
    return {metaballs_.data() + begin_[block], metaballs_.data() + begin_[block + 1]};
  }
  // The block `step` (0 or 1 on each axis) after this one, or -1.
  std::int64_t Neighbor(std::size_t block, const std::array<int, 3>& step) const;

 private:
  std::vector<std::uint64_t> keys_;   // ascending
  std::vector<std::uint64_t> begin_;  // size() + 1
  std::vector<std::uint32_t> metaballs_;
};

}  // namespace sherd
