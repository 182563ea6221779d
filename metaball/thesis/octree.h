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
#include "metaball/thesis/octree_view.h"
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
  OctreeCell CellOf(const Vec3d& point) const { return View().CellOf(point); }

  // The metaballs of a node of the finest depth: indices into the cloud.
  std::span<const std::uint32_t> MetaballsOf(std::uint32_t key_node) const {
    const OctreeList list = View().ListOf(key_node);
    return {metaball_.data() + list.begin, list.end - list.begin};
  }
  // As OctreeView has it.
  bool IsNear(std::uint32_t key_node, int depth) const { return View().IsNear(key_node, depth); }

  // Valid until the next Build.
  OctreeView<double> View() const {
    return {depth_, corner_, size_, near_.data(), held_.data(), held_before_.data(), begin_.data()};
  }
  // The arrays behind the view, and the metaballs of all nodes, list after list: indices into the
  // cloud. Valid until the next Build.
  std::span<const std::uint64_t> near() const { return near_; }
  std::span<const std::uint64_t> held() const { return held_; }
  std::span<const std::uint32_t> held_before() const { return held_before_; }
  std::span<const std::uint32_t> begin() const { return begin_; }
  std::span<const std::uint32_t> metaballs() const { return metaball_; }
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
