// A ray's way through an octree, node by node across faces (thesis algorithm 1).
#pragma once

#include <cstdint>

#include "metaball/density/scalar_math.h"
#include "metaball/hostdevice.h"
#include "metaball/thesis/octree_key.h"
#include "metaball/thesis/octree_view.h"
#include "metaball/vec.h"

namespace sherd {

// Visits the finest nodes near metaballs in the order in which the ray meets them. Where a larger
// node has nothing near it, that is visited in their place and crossed in one step.
template <class Real>
class OctreeWalk {
 public:
  // The octree must outlive the walk. Starts where the ray's part from its origin on enters the
  // cube. direction: of unit length.
  SHERD_HD OctreeWalk(const OctreeView<Real>& octree, const Vec3<Real>& origin,
                      const Vec3<Real>& direction)
      : octree_(octree), origin_(origin), direction_(direction) {
    Real enter = Real(0), exit = Real(INFINITY);
    bool beside = false;
    const auto clip = [&](Real o, Real d, Real low) {
      const Real high = low + octree_.size;
      if (d == Real(0)) {
        beside = beside || o < low || o > high;
        return;
      }
      const Real t0 = (low - o) / d, t1 = (high - o) / d;
      enter = Max(Min(t0, t1), enter);
      exit = Min(Max(t0, t1), exit);
    };
    clip(origin.x, direction.x, octree.corner.x);
    clip(origin.y, direction.y, octree.corner.y);
    clip(origin.z, direction.z, octree.corner.z);
    if (!beside && enter <= exit) Settle(octree.CellOf(origin + direction * enter));
  }

  SHERD_HD bool inside() const { return node_ != kOctreeOutside; }  // false: has left the cube
  SHERD_HD std::uint32_t node() const { return node_; }
  SHERD_HD int depth() const { return depth_; }
  SHERD_HD bool near() const { return near_; }  // the node is a finest one, near metaballs

  // While inside.
  SHERD_HD void Step() {
    const Real cell = octree_.size / Real(kOctreeSide);
    const OctreeCell low = CellOfKey(node_);
    const std::uint32_t side = 1u << (kOctreeMaxDepth - depth_);
    Real exit = Real(INFINITY);
    OctreeAxis through = OctreeAxis::kX;
    bool positive = false;
    const auto cross = [&](OctreeAxis axis, Real o, Real d, Real corner, std::uint32_t lowest) {
      if (d == Real(0)) return;
      const Real plane = corner + cell * Real(lowest + (d > Real(0) ? side : 0));
      const Real t = (plane - o) / d;
      if (!(t < exit)) return;
      exit = t;
      through = axis;
      positive = d > Real(0);
    };
    cross(OctreeAxis::kX, origin_.x, direction_.x, octree_.corner.x, low.x);
    cross(OctreeAxis::kY, origin_.y, direction_.y, octree_.corner.y, low.y);
    cross(OctreeAxis::kZ, origin_.z, direction_.z, octree_.corner.z, low.z);
    const std::uint32_t next = FaceNeighbour(node_, depth_, through, positive);
    if (next == kOctreeOutside) {
      node_ = kOctreeOutside;
      return;
    }
    // The finest cell in which the ray enters the neighbour, kept inside it whatever is rounded: so
    // the walk goes on along the ray's signs and ends.
    const OctreeCell at = octree_.CellOf(origin_ + direction_ * exit);
    const OctreeCell corner = CellOfKey(next);
    Settle({Kept(at.x, corner.x, side), Kept(at.y, corner.y, side), Kept(at.z, corner.z, side)});
  }

 private:
  SHERD_HD static std::uint32_t Kept(std::uint32_t v, std::uint32_t lowest, std::uint32_t side) {
    return Min(Max(v, lowest), lowest + side - 1);
  }

  // Takes the largest node at the cell that has nothing near it, or else the finest. Looked for
  // from the finest upwards: what has nothing near it has no part that has.
  SHERD_HD void Settle(const OctreeCell& cell) {
    const std::uint32_t key = OctreeKey(cell);
    depth_ = octree_.depth;
    near_ = octree_.IsNear(NodeOfKey(key, depth_), depth_);
    if (!near_) {
      while (depth_ > 0 && !octree_.IsNear(NodeOfKey(key, depth_ - 1), depth_ - 1)) --depth_;
    }
    node_ = NodeOfKey(key, depth_);
  }

  const OctreeView<Real>& octree_;
  Vec3<Real> origin_, direction_;
  std::uint32_t node_ = kOctreeOutside;
  int depth_ = 0;
  bool near_ = false;
};

}  // namespace sherd
