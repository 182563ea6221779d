// A tree of boxes around the supports of a cloud's metaballs, and the beams that are asked of it.
// Built in one pass over a cloud that BuildCloud made: its Morton order is the tree.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/vec.h"

namespace sherd {

// Rays that stay near an axis: each is at its parameter t, begin <= t <= end, no farther than
// `spread` from origin + t direction. Local units.
struct Beam {
  Vec3f origin, direction, inverse;  // inverse: 1 / direction, finite
  float spread = 0, begin = 0, end = 0;
};

struct SupportTree {
  static constexpr int kWidth = 16;  // children of a box

  // Boxes 16 i to 16 i + 15 are the children of box i one level up. Padded to full sixteens with
  // boxes that no beam meets.
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

  std::uint32_t IndexOf(std::size_t k) const {
    return order.empty() ? static_cast<std::uint32_t>(k) : order[k];
  }
  // The beam with what floats lose added to its spread. end may be infinite.
  Beam BeamAlong(const Vec3d& origin, const Vec3d& direction, double spread, double begin,
                 double end) const;
};

}  // namespace sherd
