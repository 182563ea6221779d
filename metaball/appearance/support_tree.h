// A tree of boxes around the supports of a cloud's metaballs, and the beams that are asked of it.
// Built in one pass over a cloud that BuildCloud made: its Morton order is the tree.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "metaball/appearance/support_tree_view.h"
#include "metaball/cloud.h"
#include "metaball/vec.h"

namespace sherd {

// The order in which a cloud's metaballs make a tree of neighbours: indices into the cloud; empty
// where its own order does, as after BuildCloud. The cloud must not be empty.
std::vector<std::uint32_t> TreeOrder(const Cloud& cloud, int threads);

struct SupportTree {
  static constexpr int kWidth = SupportTreeView::kWidth;

  // As SupportTreeLevelView.
  struct Level {
    std::vector<float> min_x, min_y, min_z, max_x, max_y, max_z;
    std::size_t size() const { return min_x.size(); }
  };
  std::vector<Level> levels;  // the first: of 16 metaballs each; the last: at most 16 boxes
  // The metaballs in the tree's order, padded with some that no beam meets; radii of the supports,
  // rounded up.
  std::vector<float> x, y, z, radius;
  std::vector<std::uint32_t> order;  // their indices into the cloud; empty: the cloud's own order
  Vec3d middle{};                    // of a ball around all supports
  double reach = 0;                  // that ball's radius

  // radius_scale: from a metaball's radius to its support's.
  SupportTree(const Cloud& cloud, double radius_scale, int threads);

  // Valid while the tree lives unchanged.
  SupportTreeView view() const;
};

}  // namespace sherd
