// The thesis's Morton octree against integer arithmetic.
#include "metaball/thesis/octree_key.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace sherd {
namespace {

// A node by integers: its coordinates on the grid of its depth, 0 .. 2^depth - 1.
OctreeCell CornerOf(const OctreeCell& node, int depth) {
  const int shift = kOctreeMaxDepth - depth;
  return {node.x << shift, node.y << shift, node.z << shift};
}
std::uint32_t NodeKey(const OctreeCell& node, int depth) {
  return OctreeKey(CornerOf(node, depth));
}

// All 26 neighbours of one node against adding 1 or -1 to its coordinates.
void ExpectNeighbours(const OctreeCell& node, int depth) {
  const int side = 1 << depth;
  const std::uint32_t key = NodeKey(node, depth);
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int x = static_cast<int>(node.x) + dx;
        const int y = static_cast<int>(node.y) + dy;
        const int z = static_cast<int>(node.z) + dz;
        const bool inside = std::min({x, y, z}) >= 0 && std::max({x, y, z}) < side;
        const std::uint32_t expected =
            inside ? NodeKey({static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                              static_cast<std::uint32_t>(z)},
                             depth)
                   : kOctreeOutside;
        ASSERT_EQ(OctreeNeighbour(key, depth, dx, dy, dz), expected)
            << "depth " << depth << ", node " << node.x << " " << node.y << " " << node.z
            << ", offset " << dx << " " << dy << " " << dz;
      }
    }
  }
}

TEST(OctreeKey, GroupsAreZYXWithTheFirstLevelOnTop) {
  EXPECT_EQ(OctreeKey({1, 0, 0}), kOctreeInside | 1u);
  EXPECT_EQ(OctreeKey({0, 1, 0}), kOctreeInside | 2u);
  EXPECT_EQ(OctreeKey({0, 0, 1}), kOctreeInside | 4u);
  EXPECT_EQ(OctreeKey({512, 0, 0}), kOctreeInside | 1u << 27);
  EXPECT_EQ(OctreeKey({1023, 1023, 1023}), 0x7fffffffu);
  EXPECT_TRUE(IsInsideOctree(OctreeKey({0, 0, 0})));
  EXPECT_FALSE(IsInsideOctree(kOctreeOutside));
}

TEST(OctreeKey, KeyAndCellAreInverse) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::uint32_t> coordinate(0, kOctreeSide - 1);
  for (int i = 0; i < 10000; ++i) {
    const OctreeCell cell{coordinate(random), coordinate(random), coordinate(random)};
    ASSERT_EQ(CellOfKey(OctreeKey(cell)), cell);
  }
}

TEST(OctreeKey, IsTheTopOfThe63BitKey) {
  std::mt19937 random(2);
  std::uniform_int_distribution<std::uint32_t> coordinate(0, (1u << 21) - 1);
  for (int i = 0; i < 10000; ++i) {
    const std::uint32_t x = coordinate(random), y = coordinate(random), z = coordinate(random);
    ASSERT_EQ(OctreeKeyOf63(MortonKey63(x, y, z)), OctreeKey({x >> 11, y >> 11, z >> 11}));
  }
}

TEST(OctreeKey, NodesFillTheArrayOnceEach) {
  EXPECT_EQ(OctreeNodesAbove(3), 73u);  // three levels
  EXPECT_EQ(OctreeNodesAbove(1), 1u);
  std::vector<int> used(OctreeNodesAbove(5), 0);
  for (int depth = 0; depth <= 4; ++depth) {
    const auto side = 1u << depth;
    for (std::uint32_t z = 0; z < side; ++z) {
      for (std::uint32_t y = 0; y < side; ++y) {
        for (std::uint32_t x = 0; x < side; ++x) {
          const std::size_t index = OctreeNodeIndex(NodeKey({x, y, z}, depth), depth);
          ASSERT_LT(index, used.size());
          ASSERT_GE(index, OctreeNodesAbove(depth));
          ++used[index];
        }
      }
    }
  }
  for (const int count : used) ASSERT_EQ(count, 1);
  EXPECT_EQ(OctreeNodeIndex(kOctreeRoot, 0), 0u);
  EXPECT_EQ(OctreeNodeIndex(0x7fffffffu, 10), OctreeNodesAbove(11) - 1);
}

TEST(OctreeKey, TheTwentySixNeighboursOfEveryNodeOfTheFirstDepths) {
  for (int depth = 0; depth <= 5; ++depth) {
    const auto side = 1u << depth;
    for (std::uint32_t z = 0; z < side; ++z) {
      for (std::uint32_t y = 0; y < side; ++y) {
        for (std::uint32_t x = 0; x < side; ++x) ExpectNeighbours({x, y, z}, depth);
      }
    }
  }
}

TEST(OctreeKey, TheTwentySixNeighboursOfDeepNodes) {
  std::mt19937 random(3);
  for (int depth = 6; depth <= kOctreeMaxDepth; ++depth) {
    const std::uint32_t last = (1u << depth) - 1;
    std::uniform_int_distribution<std::uint32_t> coordinate(0, last);
    for (int i = 0; i < 3000; ++i) {
      ExpectNeighbours({coordinate(random), coordinate(random), coordinate(random)}, depth);
    }
    // Where carries are longest: both borders, and both sides of the middle planes.
    const std::uint32_t special[] = {0, 1, last / 2, last / 2 + 1, last - 1, last};
    for (const std::uint32_t x : special) {
      for (const std::uint32_t y : special) {
        for (const std::uint32_t z : special) ExpectNeighbours({x, y, z}, depth);
      }
    }
  }
}

TEST(OctreeKey, ANodeHoldsWhatLiesInItsBox) {
  std::mt19937 random(4);
  std::uniform_int_distribution<std::uint32_t> coordinate(0, kOctreeSide - 1);
  for (int depth = 0; depth <= kOctreeMaxDepth; ++depth) {
    const int shift = kOctreeMaxDepth - depth;
    for (int i = 0; i < 500; ++i) {
      const OctreeCell metaball{coordinate(random), coordinate(random), coordinate(random)};
      OctreeCell other{coordinate(random), coordinate(random), coordinate(random)};
      if (i % 2 == 0) other = {metaball.x ^ 1, metaball.y, metaball.z};  // often the same node
      const bool same = metaball.x >> shift == other.x >> shift &&
                        metaball.y >> shift == other.y >> shift &&
                        metaball.z >> shift == other.z >> shift;
      ASSERT_EQ(NodeHolds(NodeOfKey(OctreeKey(other), depth), depth, OctreeKey(metaball)), same);
    }
  }
  EXPECT_FALSE(NodeHolds(kOctreeRoot, 0, kOctreeOutside));
}

// The printed test never misses the right node, but it also names wrong ones: at depth d each of
// the 3d bits that is set in the metaball's key may be set or not in the node's, so a metaball in
// the last corner is found in every node there is.
TEST(OctreeKey, ThePrintedMembershipTestIsTrueForWrongNodes) {
  constexpr int kDepth = 3;
  const std::uint32_t side = 1u << kDepth;
  const auto count = [&](std::uint32_t key_metaball) {
    int printed = 0, right = 0;
    for (std::uint32_t z = 0; z < side; ++z) {
      for (std::uint32_t y = 0; y < side; ++y) {
        for (std::uint32_t x = 0; x < side; ++x) {
          const std::uint32_t node = NodeKey({x, y, z}, kDepth);
          const bool holds = NodeHolds(node, kDepth, key_metaball);
          right += holds ? 1 : 0;
          printed += PrintedNodeHolds(node, key_metaball) ? 1 : 0;
          EXPECT_TRUE(!holds || PrintedNodeHolds(node, key_metaball));
        }
      }
    }
    EXPECT_EQ(right, 1);
    return printed;
  };
  EXPECT_EQ(count(OctreeKey({0, 0, 0})), 1);  // no bit set: only here it is right
  EXPECT_EQ(count(OctreeKey({512, 0, 0})), 2);
  EXPECT_EQ(count(OctreeKey({1023, 1023, 1023})), 512);
}

}  // namespace
}  // namespace sherd
