// Neighbours against a search of all points, for clouds near and far, small and large.
#include "reconstruction/neighbors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace sherd {
namespace {

struct Place {
  const char* name;
  double scale;
  Vec3d origin;
};

void PrintTo(const Place& place, std::ostream* out) { *out << place.name; }

class Neighbors : public ::testing::TestWithParam<Place> {};

std::vector<Vec3d> PointsOf(const Place& place) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform;
  std::vector<Vec3d> out;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d p{uniform(random), uniform(random), 0.1 * uniform(random)};
    out.push_back(place.origin + place.scale * p);
  }
  out[7] = out[8];  // two that coincide
  return out;
}

// All distances from p, the nearest first.
std::vector<double> DistancesFrom(const Vec3d& p, const std::vector<Vec3d>& points) {
  std::vector<double> out;
  for (const Vec3d& q : points) {
    const Vec3d d = q - p;
    out.push_back(std::hypot(d.x, d.y, d.z));  // squares would overflow
  }
  std::sort(out.begin(), out.end());
  return out;
}

TEST_P(Neighbors, AreTheNearest) {
  const std::vector<Vec3d> points = PointsOf(GetParam());
  const double scale = GetParam().scale;
  const NeighborSearch search(points);
  constexpr int kMost = 20;
  int idx[kMost];
  float distance[kMost];
  // Coordinates and distances are rounded: to doubles far from the origin, and to floats.
  const double origin = Length(GetParam().origin);
  const double rounding = 1e-6 * scale + 1e-15 * origin;
  for (std::size_t i = 0; i < points.size(); i += 13) {
    const std::vector<double> all = DistancesFrom(points[i], points);
    ASSERT_EQ(search.Nearest(i, kMost, idx, distance), kMost);
    EXPECT_EQ(distance[0], 0);
    for (int k = 0; k < kMost; ++k) {
      EXPECT_NEAR(distance[k], all[static_cast<std::size_t>(k)], rounding);
      const Vec3d d = points[static_cast<std::size_t>(idx[k])] - points[i];
      EXPECT_NEAR(std::hypot(d.x, d.y, d.z), distance[k], rounding);
    }
    // No rounding decides between the fifth and the sixth.
    const double radius = (all[5] + all[6]) / 2;
    if (all[6] - all[5] < 10 * rounding) continue;
    EXPECT_EQ(search.Within(i, radius, kMost, idx, distance), 6);
    EXPECT_NEAR(distance[5], all[5], rounding);
    EXPECT_EQ(search.Within(i, radius, 3, idx, distance), 3);
    EXPECT_NEAR(distance[2], all[2], rounding);
    EXPECT_EQ(search.CountWithin(i, radius), 6);
    const Vec3d beside = points[i] + Vec3d{0.1 * scale, 0, 0};
    const int nearest = search.NearestTo(beside);
    ASSERT_GE(nearest, 0);
    const Vec3d d = points[static_cast<std::size_t>(nearest)] - beside;
    EXPECT_NEAR(std::hypot(d.x, d.y, d.z), DistancesFrom(beside, points)[0], rounding);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Neighbors,
                         ::testing::Values(Place{"unit", 1, {}},
                                           Place{"grid", 10, {4.4e5, 5.6e6, 120}},
                                           Place{"tiny", 1e-30, {}}, Place{"huge", 1e30, {}}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(NeighborsOfFew, FewerAreFoundThanAskedFor) {
  const std::vector<Vec3d> none, two{{0, 0, 0}, {3, 4, 0}};
  int idx[5];
  float distance[5];
  EXPECT_EQ(NeighborSearch(none).NearestTo({1, 2, 3}), -1);
  const NeighborSearch search(two);
  ASSERT_EQ(search.Nearest(0, 5, idx, distance), 2);
  EXPECT_EQ(idx[1], 1);
  EXPECT_FLOAT_EQ(distance[1], 5);
  EXPECT_EQ(search.NearestTo({3, 3, 0}), 1);
}

TEST(NeighborsOfFew, AStrayHoweverFarAwayIsFarFromAll) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 400; ++i) points.push_back({i % 20 * 0.1, i / 20 * 0.1, 0});
  points.push_back({1e200, 0, 0});
  const NeighborSearch search(points);
  int idx[3];
  float distance[3];
  ASSERT_EQ(search.Nearest(400, 3, idx, distance), 3);
  EXPECT_EQ(idx[0], 400);
  EXPECT_GT(distance[1], 1000);
  ASSERT_EQ(search.Nearest(0, 3, idx, distance), 3);
  EXPECT_NEAR(distance[2], 0.1, 1e-6);
}

}  // namespace
}  // namespace sherd
