// The walk through the tree of supports finds what a look at every one of them finds.
#include "metaball/appearance/support_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "metaball/appearance/occlusion.h"
#include "metaball/bits.h"
#include "metaball/density/scalar_math.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

#define SHERD_FORMULA SHERD_HD
#include "metaball/appearance/beam-inl.h"
#undef SHERD_FORMULA

struct Finder {
  const SupportTreeView& tree;
  const Beam& beam;
  std::set<std::uint32_t> found;
  int boxes = 0, repeated = 0;

  bool Meets(std::size_t k) const {
    float front = 0, exit = 0;
    return BeamMeetsSupport(beam, tree.x[k], tree.y[k], tree.z[k], tree.radius[k], &front, &exit);
  }
  std::uint32_t Boxes(const SupportTreeLevelView& level, std::uint32_t first) {
    EXPECT_LE(first + SupportTreeView::kWidth, level.size);
    ++boxes;
    std::uint32_t met = 0;
    for (std::uint32_t b = 0; b < SupportTreeView::kWidth; ++b) {
      const std::uint32_t k = first + b;
      if (BeamMeetsBox(beam, level.min_x[k], level.min_y[k], level.min_z[k], level.max_x[k],
                       level.max_y[k], level.max_z[k])) {
        met |= std::uint32_t{1} << b;
      }
    }
    return met;
  }
  void Metaballs(std::uint32_t first) {
    EXPECT_LE(first + SupportTreeView::kWidth, tree.size);
    for (std::uint32_t k = first; k < first + SupportTreeView::kWidth; ++k) {
      if (Meets(k)) repeated += !found.insert(tree.IndexOf(k)).second;
    }
  }
};

TEST(SupportTree, AWalkFindsEverySupportThatABeamMeets) {
  // One sixteen, two levels, four levels.
  for (const int metaballs : {5, 200, 70000}) {
    const Scene scene =
        testing::SceneOf(testing::RandomBall(metaballs, 0.8 / std::cbrt(metaballs), 3, 17));
    const Cloud& cloud = *scene.cloud;
    const SupportTree tree(cloud, 1.0, 1);
    const SupportTreeView view = tree.view();
    std::size_t met = 0;
    for (int k = 0; k < 20; ++k) {
      const Vec3d direction = FibonacciDirection(k, 20);
      const double spread = k % 2 == 0 ? 0 : 0.02;
      const Beam beam = view.BeamAlong(direction * -0.4, direction, spread, 0.1, INFINITY);
      Finder finder{view, beam, {}};
      WalkTree(view, &finder);
      std::set<std::uint32_t> expected;
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        if (finder.Meets(i)) expected.insert(view.IndexOf(i));
      }
      EXPECT_EQ(finder.found, expected);
      EXPECT_EQ(finder.repeated, 0);
      EXPECT_LT(finder.boxes, 2 + metaballs / 160);
      met += expected.size();
    }
    EXPECT_GT(met, 0u);
  }
}

}  // namespace
}  // namespace sherd
