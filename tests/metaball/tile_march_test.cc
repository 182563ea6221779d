#include "metaball/tile_march.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace sherd {
namespace {

// On its own, as the compiler's mistake does not show where it can see the point.
GTEST_NO_INLINE_ void Split(const Vec3d& p, SplitPoint* split) { *split = SplitPoint::From(p); }

// What anchors are for: a point far from the origin keeps its place among metaballs near it. Pairs
// of coordinates are what a compiler may round together, and get wrong (SherdTargets.cmake).
TEST(SplitPoint, HoldsTwiceAFloatInEveryCoordinate) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-2, 2);
  double largest[3] = {0, 0, 0};
  for (int i = 0; i < 1000; ++i) {
    const Vec3d p{coordinate(random), coordinate(random), coordinate(random)};
    SplitPoint split;
    Split(p, &split);
    const Vec3d sum = split.high.cast<double>() + split.low.cast<double>();
    EXPECT_LE(std::abs(sum.x - p.x), std::ldexp(1.0, -48));
    EXPECT_LE(std::abs(sum.y - p.y), std::ldexp(1.0, -48));
    EXPECT_LE(std::abs(sum.z - p.z), std::ldexp(1.0, -48));
    largest[0] = std::max(largest[0], std::abs(static_cast<double>(split.low.x)));
    largest[1] = std::max(largest[1], std::abs(static_cast<double>(split.low.y)));
    largest[2] = std::max(largest[2], std::abs(static_cast<double>(split.low.z)));
  }
  for (const double low : largest) {
    EXPECT_GT(low, std::ldexp(1.0, -26)) << "nothing was left over";
    EXPECT_LE(low, std::ldexp(1.0, -24)) << "more than a float's rounding was left over";
  }
}

TEST(SplitPoint, DifferencesAreThoseOfDoubles) {
  const Vec3d p{1.23456789012, -0.98765432109, 1.55555555555};
  SplitPoint split;
  Split(p, &split);
  const Vec3f near{1.25f, -1.0f, 1.5f};
  const Vec3d exact = near.cast<double>() - p;
  const Vec3f got = Minus(near, split);
  EXPECT_NEAR(got.x, exact.x, 4e-9);
  EXPECT_NEAR(got.y, exact.y, 4e-9);
  EXPECT_NEAR(got.z, exact.z, 4e-9);
}

}  // namespace
}  // namespace sherd
