// The thesis's octree by Morton keys (thesis, section 2.4.2): keys, nodes in a one-dimensional
// array, and the twenty-six neighbours of a node by bits alone.
//
// A key is 32 bits wide. The low thirty hold ten groups of three bits, z y x with x lowest; the
// most significant group chooses among the root's eight children, the next among theirs, and so on.
// The top two bits say where the key lies: 01 inside the octree, 00 outside. A node at depth d
// (the root's depth is 0) has its first d groups set and the others zero.
#pragma once

#include <cstddef>
#include <cstdint>

#include "metaball/hostdevice.h"
#include "metaball/morton.h"

namespace sherd {

inline constexpr int kOctreeMaxDepth = 10;
inline constexpr std::uint32_t kOctreeSide = 1u << kOctreeMaxDepth;  // coordinates 0..1023
inline constexpr std::uint32_t kOctreeInside = 1u << 30;
inline constexpr std::uint32_t kOctreeOutside = 0;
inline constexpr std::uint32_t kOctreeRoot = kOctreeInside;

struct OctreeCell {
  std::uint32_t x = 0, y = 0, z = 0;

  friend SHERD_HD constexpr bool operator==(const OctreeCell& a, const OctreeCell& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  }
};

// The key of a position on the 1024^3 grid, each coordinate below kOctreeSide.
SHERD_HD constexpr std::uint32_t OctreeKey(const OctreeCell& cell) {
  return kOctreeInside | static_cast<std::uint32_t>(MortonKey63(cell.x, cell.y, cell.z));
}
// The same from a 63-bit key of morton.h: its first ten levels.
SHERD_HD constexpr std::uint32_t OctreeKeyOf63(std::uint64_t key63) {
  return kOctreeInside | static_cast<std::uint32_t>(key63 >> 33);
}
SHERD_HD constexpr bool IsInsideOctree(std::uint32_t key) { return key >> 30 == 1; }

// Every third bit of the low thirty from bit 0, packed.
SHERD_HD constexpr std::uint32_t PackBits10(std::uint32_t v) {
  v &= 0x09249249u;
  v = (v | v >> 2) & 0x030c30c3u;
  v = (v | v >> 4) & 0x0300f00fu;
  v = (v | v >> 8) & 0x030000ffu;
  v = (v | v >> 16) & 0x000003ffu;
  return v;
}
// The lowest corner of a key's node on the 1024^3 grid.
SHERD_HD constexpr OctreeCell CellOfKey(std::uint32_t key) {
  return {PackBits10(key), PackBits10(key >> 1), PackBits10(key >> 2)};
}

// The bits of the first `depth` groups.
SHERD_HD constexpr std::uint32_t OctreeDepthMask(int depth) {
  return 0x3fffffffu & ~((1u << (3 * (kOctreeMaxDepth - depth))) - 1);
}
// The node of that depth that holds a key inside the octree.
SHERD_HD constexpr std::uint32_t NodeOfKey(std::uint32_t key, int depth) {
  return kOctreeInside | (key & OctreeDepthMask(depth));
}

// Whether the node of that depth holds a metaball's key: the prefixes are compared.
SHERD_HD constexpr bool NodeHolds(std::uint32_t key_node, int depth, std::uint32_t key_metaball) {
  return IsInsideOctree(key_metaball) && NodeOfKey(key_metaball, depth) == key_node;
}
// The test the thesis prints. It is also true for other nodes than the right one: for any node
// whose set bits are among the metaball's. Kept to show that; nothing draws with it.
SHERD_HD constexpr bool PrintedNodeHolds(std::uint32_t key_node, std::uint32_t key_metaball) {
  return (key_metaball & key_node) == key_node;
}

// Nodes above depth `depth`, that is, before its first in the array: 0, 1, 9, 73, ...
SHERD_HD constexpr std::size_t OctreeNodesAbove(int depth) {
  return ((std::size_t{1} << (3 * depth)) - 1) / 7;
}
// A node's place in the one-dimensional array: depth by depth, within a depth by key. Three levels
// (depths 0, 1 and 2) have 1 + 8 + 64 = 73 nodes.
SHERD_HD constexpr std::size_t OctreeNodeIndex(std::uint32_t key_node, int depth) {
  return OctreeNodesAbove(depth) + ((key_node & 0x3fffffffu) >> (3 * (kOctreeMaxDepth - depth)));
}

enum class OctreeAxis { kX = 0, kY = 1, kZ = 2 };  // left/right, up/down, front/back

// The node across a face, of the same depth, or kOctreeOutside (thesis algorithm 1): from the
// node's own group upwards, the axis's bit is flipped; the walk ends with the first group that had
// room in the direction, where no carry goes on.
SHERD_HD constexpr std::uint32_t FaceNeighbour(std::uint32_t key_node, int depth, OctreeAxis axis,
                                               bool positive) {
  const std::uint32_t room = positive ? 0 : 1;
  for (int i = kOctreeMaxDepth - depth; i <= kOctreeMaxDepth - 1; ++i) {
    const int shift = 3 * i + static_cast<int>(axis);
    const std::uint32_t before = key_node >> shift & 1u;
    key_node ^= 1u << shift;
    if (before == room) return key_node;
  }
  return kOctreeOutside;
}

// The neighbour at an offset of -1, 0 or 1 on each axis: across an edge algorithm 1 is applied
// twice, across a corner three times. The node itself for the offset 0, 0, 0.
SHERD_HD constexpr std::uint32_t OctreeNeighbour(std::uint32_t key_node, int depth, int dx, int dy,
                                                 int dz) {
  if (dx != 0) key_node = FaceNeighbour(key_node, depth, OctreeAxis::kX, dx > 0);
  if (dy != 0 && key_node != kOctreeOutside) {
    key_node = FaceNeighbour(key_node, depth, OctreeAxis::kY, dy > 0);
  }
  if (dz != 0 && key_node != kOctreeOutside) {
    key_node = FaceNeighbour(key_node, depth, OctreeAxis::kZ, dz > 0);
  }
  return key_node;
}

}  // namespace sherd
