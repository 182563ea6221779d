// The octree's lists and marks against a search through every metaball.
#include "metaball/thesis/octree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "metaball/error.h"
#include "metaball/thesis/octree_walk.h"
#include "test_scenes.h"

namespace sherd {
namespace {

Cloud SomeCloud(int n = 300) { return BuildCloud(testing::RandomBall(n, 0.1, 2, 1)); }

TEST(MortonOctree, TheCubeHoldsCentresAndMargin) {
  const Cloud cloud = SomeCloud();
  MortonOctree octree;
  octree.Build(cloud, 0.25, 4, {});
  const Box3f box = cloud.CenterBox();
  const Vec3d high = octree.corner() + Vec3d{octree.size(), octree.size(), octree.size()};
  EXPECT_LE(octree.corner().x, box.min.x - 0.25);
  EXPECT_LE(octree.corner().y, box.min.y - 0.25);
  EXPECT_LE(octree.corner().z, box.min.z - 0.25);
  EXPECT_GE(high.x, box.max.x + 0.25);
  EXPECT_GE(high.y, box.max.y + 0.25);
  EXPECT_GE(high.z, box.max.z + 0.25);
  EXPECT_EQ(octree.CellOf(octree.corner()), (OctreeCell{0, 0, 0}));
  EXPECT_EQ(octree.CellOf(high), (OctreeCell{1023, 1023, 1023}));
  EXPECT_EQ(octree.CellOf(octree.corner() - Vec3d{1, 1, 1}), (OctreeCell{0, 0, 0}));
}

TEST(MortonOctree, ListsHoldEveryMetaballOnceInItsNode) {
  const Cloud cloud = SomeCloud();
  for (const int depth : {1, 3, 5}) {
    MortonOctree octree;
    octree.Build(cloud, 0.1, depth, {});
    std::vector<int> found(cloud.size(), 0);
    const std::uint32_t side = 1u << depth;
    const int shift = kOctreeMaxDepth - depth;
    for (std::uint32_t z = 0; z < side; ++z) {
      for (std::uint32_t y = 0; y < side; ++y) {
        for (std::uint32_t x = 0; x < side; ++x) {
          for (const std::uint32_t idx :
               octree.MetaballsOf(OctreeKey({x << shift, y << shift, z << shift}))) {
            ++found[idx];
            const OctreeCell cell = octree.CellOf(cloud.center[idx].cast<double>());
            EXPECT_EQ(cell.x >> shift, x);
            EXPECT_EQ(cell.y >> shift, y);
            EXPECT_EQ(cell.z >> shift, z);
          }
        }
      }
    }
    for (const int count : found) ASSERT_EQ(count, 1) << depth;
  }
}

TEST(MortonOctree, MarksAreWhereANeighbourHoldsSomething) {
  const Cloud cloud = SomeCloud(20);
  constexpr int kDepth = 4, kSide = 1 << kDepth, kShift = kOctreeMaxDepth - kDepth;
  MortonOctree octree;
  octree.Build(cloud, 0.1, kDepth, {});
  for (int depth = 0; depth <= kDepth; ++depth) {
    const int span = 1 << (kDepth - depth);  // finest nodes a side of one of this depth
    int marked = 0, nodes = 0;
    for (int z = 0; z < kSide; z += span) {
      for (int y = 0; y < kSide; y += span) {
        for (int x = 0; x < kSide; x += span) {
          bool near = false;
          for (const Vec3f& center : cloud.center) {
            const OctreeCell cell = octree.CellOf(center.cast<double>());
            const int cx = static_cast<int>(cell.x >> kShift);
            const int cy = static_cast<int>(cell.y >> kShift);
            const int cz = static_cast<int>(cell.z >> kShift);
            near |= cx >= x - 1 && cx <= x + span && cy >= y - 1 && cy <= y + span && cz >= z - 1 &&
                    cz <= z + span;
          }
          const std::uint32_t key = OctreeKey({static_cast<std::uint32_t>(x) << kShift,
                                               static_cast<std::uint32_t>(y) << kShift,
                                               static_cast<std::uint32_t>(z) << kShift});
          ASSERT_EQ(octree.IsNear(key, depth), near) << depth << ": " << x << " " << y << " " << z;
          marked += near ? 1 : 0;
          ++nodes;
        }
      }
    }
    EXPECT_GT(marked, 0);
    if (depth == kDepth) {
      EXPECT_LT(marked, nodes / 2);  // both answers are tried
    }
  }
}

TEST(MortonOctree, TheGreatestDepthTakesBitsNotLists) {
  const Cloud cloud = SomeCloud();
  MortonOctree octree;
  octree.Build(cloud, 0.1, kOctreeMaxDepth, {});
  EXPECT_LT(octree.MemoryBytes(), 400u << 20);
  std::size_t found = 0;
  for (const Vec3f& center : cloud.center) {
    const std::uint32_t node = OctreeKey(octree.CellOf(center.cast<double>()));
    const auto list = octree.MetaballsOf(node);
    found += list.size();
    EXPECT_FALSE(list.empty());
    EXPECT_TRUE(octree.IsNear(node, kOctreeMaxDepth));
  }
  EXPECT_GE(found, cloud.size());
}

// Every node a ray passes through is visited, once and in the ray's order, against points taken
// densely along the ray.
TEST(OctreeWalk, VisitsEveryNodeOnTheRayInOrder) {
  const Cloud cloud = SomeCloud(40);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.5, 1.5);
  int near_nodes = 0, large_nodes = 0;
  for (const int depth : {1, 3, 5, 7}) {
    MortonOctree octree;
    octree.Build(cloud, 0.1, depth, {});
    const OctreeView<double> view = octree.View();
    for (int i = 0; i < 200; ++i) {
      RayD ray{{uniform(random), uniform(random), uniform(random)},
               {uniform(random), uniform(random), uniform(random)}};
      // Along axes and in planes of the grid too; from inside the cube and outside.
      if (i % 4 == 1) ray.direction.x = ray.direction.z = 0;
      if (i % 4 == 2) ray.direction.y = 0;
      if (i % 4 == 3) ray.origin.x = octree.corner().x + octree.size() / 2;
      if (i % 8 < 4) ray.origin = ray.origin - ray.direction * 3.0;
      ray.direction = Normalized(ray.direction);

      struct Visit {
        std::uint32_t node;
        int depth;
      };
      std::vector<Visit> visits;
      for (OctreeWalk<double> walk(view, ray.origin, ray.direction); walk.inside(); walk.Step()) {
        ASSERT_EQ(walk.near(), octree.IsNear(walk.node(), walk.depth()));
        ASSERT_TRUE(!walk.near() || walk.depth() == depth);
        visits.push_back({walk.node(), walk.depth()});
        ASSERT_LT(visits.size(), 3u << depth);
        near_nodes += walk.near() ? 1 : 0;
        large_nodes += walk.depth() < depth ? 1 : 0;
      }
      std::size_t at = 0;
      constexpr double kStep = 1e-3;
      const double margin = 1e-9 * octree.size();
      for (double t = 0; t < 12; t += kStep) {
        const Vec3d p = ray.origin + ray.direction * t, q = (p - octree.corner()) / octree.size();
        if (std::min({q.x, q.y, q.z}) < margin || std::max({q.x, q.y, q.z}) > 1 - margin) continue;
        // Points on a face belong to either side.
        const Vec3d scaled = q * static_cast<double>(kOctreeSide);
        const auto on_face = [](double v) { return std::abs(v - std::round(v)) < 1e-6; };
        if (on_face(scaled.x) || on_face(scaled.y) || on_face(scaled.z)) continue;
        const std::uint32_t key = OctreeKey(octree.CellOf(p));
        while (at < visits.size() && NodeOfKey(key, visits[at].depth) != visits[at].node) ++at;
        ASSERT_LT(at, visits.size()) << "depth " << depth << ", ray " << i << ", t " << t;
      }
    }
  }
  EXPECT_GT(near_nodes, 1000);
  EXPECT_GT(large_nodes, 1000);
}

TEST(OctreeWalk, RaysBesideTheCubeVisitNothing) {
  MortonOctree octree;
  octree.Build(SomeCloud(), 0.1, 4, {});
  const OctreeView<double> view = octree.View();
  const Vec3d middle = octree.corner() + Vec3d{1, 1, 1} * (octree.size() / 2);
  const double beside = 0.51 * octree.size();
  const RayD misses[] = {{middle + Vec3d{beside, 0, -5}, {0, 0, 1}},
                         {middle + Vec3d{0, -beside, -5}, {0, 0, 1}},
                         {middle + Vec3d{beside, 0, 0}, {1, 0, 0}},  // behind
                         {middle + Vec3d{0, 0, -5}, Normalized(Vec3d{0, 1, 1})}};
  for (const RayD& ray : misses) {
    EXPECT_FALSE(OctreeWalk<double>(view, ray.origin, ray.direction).inside());
  }
  const RayD hit{middle + Vec3d{0.98 * beside, 0, -5}, {0, 0, 1}};
  EXPECT_TRUE(OctreeWalk<double>(view, hit.origin, hit.direction).inside());
}

TEST(MortonOctree, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  Control control;
  control.stop = stop.get_token();
  MortonOctree octree;
  EXPECT_THROW(octree.Build(SomeCloud(), 0.1, 4, control), Cancelled);
}

}  // namespace
}  // namespace sherd
