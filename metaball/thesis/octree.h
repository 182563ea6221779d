// The thesis's octree over a cloud: every metaball in the node of the finest depth that holds its
// centre, nodes in a one-dimensional array addressed by Morton keys (octree_key.h).
//
// The array holds one bit a node, for the finest depth with running counts, so that the lists of
// metaballs take memory only where there are any: depth 10 has 1.2e9 nodes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/control.h"
#include "metaball/thesis/octree_key.h"
#include "metaball/vec.h"

namespace sherd {

class MortonOctree {
 public:
  // margin: the cube is the smallest around the centres and this much more on each side, local
  // units, >= 0. The thesis's own cube is [0, 1]^3; ours fits the cloud. depth: 1 to
  // kOctreeMaxDepth. Throws Cancelled; ResourceError when there is no memory for the array.
  void Build(const Cloud& cloud, double margin, int depth, const Control& control);

  int depth() const { return depth_; }
  const Vec3d& corner() const { return corner_; }  // the cube's lowest
  double size() const { return size_; }            // the cube's side
  // The cell of the 1024^3 grid that holds a point; points outside go to the nearest.
  OctreeCell CellOf(const Vec3d& point) const;

  // The metaballs of a node of the finest depth: indices into the cloud.
  std::span<const std::uint32_t> MetaballsOf(std::uint32_t key_node) const;
  // Whether a node of any depth holds a finest node that holds a metaball or has one among its 26
  // neighbours: elsewhere a ray has nothing to look for.
  bool IsNear(std::uint32_t key_node, int depth) const {
    const std::size_t i = OctreeNodeIndex(key_node, depth);
    return near_[i / 64] >> (i % 64) & 1;
  }
  std::size_t MemoryBytes() const;

 private:
  int depth_ = 0;
  Vec3d corner_{};
  double size_ = 1.0;
  std::vector<std::uint64_t> near_;  // a bit a node of every depth
  // Finest depth: a bit a node that holds metaballs; the number of such nodes before each word;
  // where the lists of such nodes begin; the lists.
  std::vector<std::uint64_t> held_;
  std::vector<std::uint32_t> held_before_;
  std::vector<std::uint32_t> begin_;
  std::vector<std::uint32_t> metaball_;
};

}  // namespace sherd
