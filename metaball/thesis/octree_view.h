// The octree's arrays as rays read them, on the CPU and on the GPU: pointers into memory that is
// held elsewhere (MortonOctree, or a copy of its arrays).
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "metaball/hostdevice.h"
#include "metaball/thesis/octree_key.h"
#include "metaball/vec.h"

namespace sherd {

// The places [begin, end) in the octree's list of metaballs.
struct OctreeList {
  std::uint32_t begin = 0, end = 0;
};

// Real: the numbers rays are traced with. Lengths are local units.
template <class Real>
struct OctreeView {
  int depth = 0;
  Vec3<Real> corner{};                         // the cube's lowest
  Real size = Real(1);                         // the cube's side
  const std::uint64_t* near = nullptr;         // a bit a node of every depth
  const std::uint64_t* held = nullptr;         // a bit a node of the finest depth
  const std::uint32_t* held_before = nullptr;  // set bits before each word of `held`
  const std::uint32_t* begin = nullptr;        // of the list of each node that holds something

  // The cell of the 1024^3 grid that holds a point; points outside go to the nearest.
  SHERD_HD OctreeCell CellOf(const Vec3<Real>& point) const {
    const Vec3<Real> p = (point - corner) / size;
    return {Coordinate(p.x), Coordinate(p.y), Coordinate(p.z)};
  }

  // Whether a node of any depth holds a finest node that holds a metaball or has one among its 26
  // neighbours: elsewhere a ray has nothing to look for.
  SHERD_HD bool IsNear(std::uint32_t key_node, int node_depth) const {
    const std::size_t i = OctreeNodeIndex(key_node, node_depth);
    return near[i / 64] >> (i % 64) & 1;
  }

  // The metaballs of a node of the finest depth.
  SHERD_HD OctreeList ListOf(std::uint32_t key_node) const {
    const std::size_t place = OctreeNodeIndex(key_node, depth) - OctreeNodesAbove(depth);
    const std::uint64_t word = held[place / 64];
    const std::uint64_t bit = std::uint64_t{1} << (place % 64);
    if (!(word & bit)) return {};
    const std::uint32_t k = held_before[place / 64] + CountBits(word & (bit - 1));
    return {begin[k], begin[k + 1]};
  }

 private:
  // NaN goes to 0.
  SHERD_HD static std::uint32_t Coordinate(Real fraction) {
    constexpr Real kLast = Real(kOctreeSide - 1);
    const Real v = fraction * Real(kOctreeSide);
    return static_cast<std::uint32_t>(v > Real(0) ? (v < kLast ? v : kLast) : Real(0));
  }
  SHERD_HD static std::uint32_t CountBits(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
    return static_cast<std::uint32_t>(__popcll(bits));
#else
    return static_cast<std::uint32_t>(std::popcount(bits));
#endif
  }
};

// A place among the metaballs of a node and its neighbours: of which neighbour (0..26, x first),
// and where in the octree's list.
struct NearPlace {
  int neighbour = 0;
  std::uint32_t place = 0;
};

// Calls f(place) for every metaball of a finest node and of its 26 neighbours, neighbour by
// neighbour; `from` is where an earlier call had come to, or a place of its own to begin.
template <class Real, class F>
SHERD_HD void ForEachNear(const OctreeView<Real>& octree, std::uint32_t node, const NearPlace& from,
                          const F& f) {
  std::uint32_t layer = kOctreeOutside, row = kOctreeOutside;
  for (int n = from.neighbour; n < 27; ++n) {
    const bool first = n == from.neighbour;
    // Neighbours in a row share their steps across z and y.
    if (first || n % 9 == 0) layer = OctreeNeighbour(node, octree.depth, 0, 0, n / 9 - 1);
    if (layer == kOctreeOutside) continue;
    if (first || n % 3 == 0) row = OctreeNeighbour(layer, octree.depth, 0, n / 3 % 3 - 1, 0);
    if (row == kOctreeOutside) continue;
    const std::uint32_t key = OctreeNeighbour(row, octree.depth, n % 3 - 1, 0, 0);
    if (key == kOctreeOutside) continue;
    const OctreeList list = octree.ListOf(key);
    const std::uint32_t begin = first && from.place > list.begin ? from.place : list.begin;
    for (std::uint32_t k = begin; k < list.end; ++k) f(NearPlace{n, k});
  }
}

}  // namespace sherd
