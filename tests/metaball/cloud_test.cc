#include "metaball/cloud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "metaball/error.h"
#include "test_scenes.h"

namespace sherd {
namespace {

TEST(Cloud, KeepsEveryMetaballWithItsChannels) {
  const CloudInput input = testing::RandomBall(500, 0.2, 10, 1);
  std::vector<std::uint32_t> order;
  CloudReport report;
  const Cloud cloud = BuildCloud(input, &report, &order);
  ASSERT_EQ(cloud.size(), 500u);
  EXPECT_EQ(report.dropped_not_finite + report.dropped_radius, 0u);
  std::vector<std::uint32_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (std::uint32_t i = 0; i < 500; ++i) EXPECT_EQ(sorted[i], i);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_NEAR(Length(cloud.frame.WorldFromLocal(cloud.center[i]) - input.center[order[i]]), 0,
                1e-7);
    EXPECT_NEAR(cloud.radius[i] * cloud.frame.unit, input.radius[order[i]], 1e-8);
    EXPECT_EQ(cloud.color[i], input.color[order[i]]);
  }
  cloud.Validate("test");
}

TEST(Cloud, ASurveyFarAwayHasTheSameLocalCoordinates) {
  CloudInput near = testing::RandomBall(300, 0.1, 3, 2), far = near;
  // A grid of 2^-20 so that adding UTM-sized numbers loses nothing.
  for (auto* input : {&near, &far}) {
    for (Vec3d& p : input->center) {
      p = {std::ldexp(std::round(std::ldexp(p.x, 20)), -20),
           std::ldexp(std::round(std::ldexp(p.y, 20)), -20),
           std::ldexp(std::round(std::ldexp(p.z, 20)), -20)};
    }
  }
  for (Vec3d& p : far.center) p += Vec3d{412345.0, 5812345.0, 100.0};
  const Cloud a = BuildCloud(near), b = BuildCloud(far);
  EXPECT_EQ(a.frame.unit, b.frame.unit);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a.center[i], b.center[i]);
}

TEST(Cloud, DropsAndCountsWhatCannotBeDrawn) {
  CloudInput input;
  input.center = {{0, 0, 0}, {NAN, 0, 0}, {0, INFINITY, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  input.radius = {1, 1, 1, 0, -2, NAN};
  CloudReport report;
  const Cloud cloud = BuildCloud(input, &report);
  EXPECT_EQ(cloud.size(), 1u);
  EXPECT_EQ(report.dropped_not_finite, 3u);
  EXPECT_EQ(report.dropped_radius, 2u);
}

TEST(Cloud, ChannelsThatAreAbsentCostNothing) {
  CloudInput input = testing::RandomBall(1000, 0.1, 1, 3);
  input.radius.clear();
  input.color.clear();
  input.uniform_radius = 0.1;
  const Cloud cloud = BuildCloud(input);
  EXPECT_EQ(cloud.MemoryBytes(), 1000u * 12);
}

TEST(Cloud, NothingAndOneAreDefined) {
  EXPECT_TRUE(BuildCloud({}).empty());
  const Cloud one = BuildCloud(testing::OneMetaball({1e7, -1e7, 5}, 1e-3));
  EXPECT_NEAR(one.radius[0] * one.frame.unit, 1e-3, 1e-9);
  EXPECT_NEAR(Length(one.frame.WorldFromLocal(one.center[0]) - Vec3d{1e7, -1e7, 5}), 0, 1e-9);
}

TEST(Cloud, ValidateNamesTheFault) {
  Cloud cloud = BuildCloud(testing::RandomBall(10, 0.1, 1, 4));
  cloud.radius[7] = -1;
  try {
    cloud.Validate("some.metaballs");
    FAIL() << "a negative radius passed";
  } catch (const InputError& error) {
    EXPECT_EQ(error.place(), "metaball 7");
    EXPECT_EQ(error.path(), "some.metaballs");
  }
}

TEST(Color, SrgbRoundTripsEveryByte) {
  for (int i = 0; i < 256; ++i) {
    const auto v = static_cast<std::uint8_t>(i);
    EXPECT_EQ(Rgb8FromLinear(LinearFromRgb8({v, v, v})).g, v);
  }
  EXPECT_EQ(Quantize8(NAN), 0);
  EXPECT_EQ(SrgbFromLinear(-1), 0);
  EXPECT_EQ(SrgbFromLinear(2), 1);
}

}  // namespace
}  // namespace sherd
