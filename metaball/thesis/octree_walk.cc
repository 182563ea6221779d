#include "metaball/thesis/octree_walk.h"

#include <algorithm>
#include <cmath>

namespace sherd {

OctreeWalk::OctreeWalk(const MortonOctree& octree, const RayD& ray)
    : octree_(octree),
      ray_(ray),
      origin_{ray.origin.x, ray.origin.y, ray.origin.z},
      direction_{ray.direction.x, ray.direction.y, ray.direction.z},
      corner_{octree.corner().x, octree.corner().y, octree.corner().z} {
  double enter = 0, exit = INFINITY;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction_[axis] == 0) {
      if (origin_[axis] < corner_[axis] || origin_[axis] > corner_[axis] + octree.size()) return;
      continue;
    }
    const double t0 = (corner_[axis] - origin_[axis]) / direction_[axis];
    const double t1 = (corner_[axis] + octree.size() - origin_[axis]) / direction_[axis];
    enter = std::max(enter, std::min(t0, t1));
    exit = std::min(exit, std::max(t0, t1));
  }
  if (enter <= exit) Settle(octree.CellOf(ray.origin + ray.direction * enter));
}

void OctreeWalk::Step() {
  const double cell = octree_.size() / kOctreeSide;
  const OctreeCell low = CellOfKey(node_);
  const std::uint32_t lows[3] = {low.x, low.y, low.z};
  const std::uint32_t side = 1u << (kOctreeMaxDepth - depth_);
  double exit = INFINITY;
  int through = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction_[axis] == 0) continue;
    const double plane = corner_[axis] + cell * (lows[axis] + (direction_[axis] > 0 ? side : 0));
    const double t = (plane - origin_[axis]) / direction_[axis];
    if (t < exit) {
      exit = t;
      through = axis;
    }
  }
  const std::uint32_t next =
      FaceNeighbour(node_, depth_, static_cast<OctreeAxis>(through), direction_[through] > 0);
  if (next == kOctreeOutside) {
    node_ = kOctreeOutside;
    return;
  }
  // The finest cell in which the ray enters the neighbour, kept inside it whatever is rounded: so
  // the walk goes on along the ray's signs and ends.
  const OctreeCell at = octree_.CellOf(ray_.origin + ray_.direction * exit);
  const OctreeCell corner = CellOfKey(next);
  Settle({std::clamp(at.x, corner.x, corner.x + side - 1),
          std::clamp(at.y, corner.y, corner.y + side - 1),
          std::clamp(at.z, corner.z, corner.z + side - 1)});
}

// Takes the largest node at the cell that has nothing near it, or else the finest.
void OctreeWalk::Settle(const OctreeCell& cell) {
  const std::uint32_t key = OctreeKey(cell);
  for (depth_ = 0;; ++depth_) {
    node_ = NodeOfKey(key, depth_);
    near_ = octree_.IsNear(node_, depth_);
    if (!near_ || depth_ == octree_.depth()) return;
  }
}

}  // namespace sherd
