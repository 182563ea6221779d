// A ray's way through an octree, node by node across faces (thesis algorithm 1).
#pragma once

#include <cstdint>

#include "metaball/camera.h"
#include "metaball/thesis/octree.h"

namespace sherd {

// Visits the finest nodes near metaballs in the order in which the ray meets them. Where a larger
// node has nothing near it, that is visited in their place and crossed in one step.
class OctreeWalk {
 public:
  // The octree and the ray must outlive the walk. Starts where the ray's part from its origin on
  // enters the cube.
  OctreeWalk(const MortonOctree& octree, const RayD& ray);

  bool inside() const { return node_ != kOctreeOutside; }  // false: the ray has left the cube
  std::uint32_t node() const { return node_; }
  int depth() const { return depth_; }
  bool near() const { return near_; }  // the node is a finest one, near metaballs
  void Step();                         // while inside

 private:
  void Settle(const OctreeCell& cell);

  const MortonOctree& octree_;
  const RayD& ray_;
  const double origin_[3], direction_[3], corner_[3];  // by axis; of the ray and the cube
  std::uint32_t node_ = kOctreeOutside;
  int depth_ = 0;
  bool near_ = false;
};

}  // namespace sherd
