// The figures that say how far a frame is from the reference, on frames made by hand.
#include "metaball/frame_difference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metaball/error.h"

namespace sherd {
namespace {

// 200 pixels in a row, all hit at depth 3 by a metaball of radius 0.5, white, seen from the front.
class FrameDifferenceTest : public ::testing::Test {
 protected:
  static constexpr int kCount = 200;
  void SetUp() override {
    frame_.width = reference_.width = kCount;
    frame_.height = reference_.height = 1;
    frame_.color.assign(kCount, {1, 1, 1, 1});
    frame_.depth.assign(kCount, 3.0f);
    frame_.normal.assign(kCount, {0, 0, 1});
    ReferenceHit hit;
    hit.hit = true;
    hit.depth = 3;
    hit.smallest_radius = 0.5;
    hit.normal = {0, 0, 1};
    hit.color = {1, 1, 1};
    reference_.pixels.assign(kCount, hit);
  }
  FrameDifference Compare() const { return CompareToReference(frame_, reference_, 1.0); }

  Frame frame_;
  ReferenceFrame reference_;
};

TEST_F(FrameDifferenceTest, EqualFramesDoNotDiffer) {
  const FrameDifference d = Compare();
  EXPECT_EQ(d.pixels, 200u);
  EXPECT_EQ(d.WrongShare(), 0);
  EXPECT_EQ(d.depth_max, 0);
  EXPECT_EQ(d.normal_max_deg, 0);
  EXPECT_EQ(d.delta_e_max, 0);
}

TEST_F(FrameDifferenceTest, AnglesHaveMedianPercentileAndMaximum) {
  // 100 pixels off by 2 degrees, one by 90, the others not at all.
  const double angle = 2 * std::acos(-1.0) / 180;
  for (int i = 0; i < 100; ++i) {
    frame_.normal[i] = {static_cast<float>(std::sin(angle)), 0,
                        static_cast<float>(std::cos(angle))};
  }
  frame_.normal[199] = {0, 1, 0};
  const FrameDifference d = Compare();
  EXPECT_NEAR(d.normal_median_deg, 2, 1e-4);
  EXPECT_NEAR(d.normal_p99_deg, 2, 1e-4);
  EXPECT_NEAR(d.normal_max_deg, 90, 1e-4);
}

TEST_F(FrameDifferenceTest, DepthIsCountedInRadii) {
  for (int i = 0; i < 150; ++i) frame_.depth[i] = 3.25f;
  const FrameDifference d = Compare();
  EXPECT_NEAR(d.depth_median, 0.5, 1e-6);
  EXPECT_NEAR(d.depth_max, 0.5, 1e-6);
}

TEST_F(FrameDifferenceTest, WrongPixelsAreCountedOnceAndGrazingOnesNot) {
  frame_.color[0] = {};                // missed
  reference_.pixels[1].hit = false;    // invented
  frame_.color[2] = {1, 0.9f, 1, 1};   // off by more than 8/255
  frame_.color[3] = {1, 0.99f, 1, 1};  // off by less
  for (int i = 100; i < 200; ++i) reference_.pixels[i].grazing = true;
  frame_.color[150] = {};
  const FrameDifference d = Compare();
  EXPECT_EQ(d.missed, 1u);
  EXPECT_EQ(d.invented, 1u);
  EXPECT_EQ(d.color_off, 1u);
  EXPECT_EQ(d.grazing, 100u);
  EXPECT_DOUBLE_EQ(d.WrongShare(), 0.03);
}

TEST_F(FrameDifferenceTest, ColoursDifferByLab) {
  for (int i = 0; i < 120; ++i) frame_.color[i] = {0, 0, 0, 1};
  const FrameDifference d = Compare();
  EXPECT_NEAR(d.delta_e_median, 100, 1e-9);  // black and white
  EXPECT_NEAR(d.delta_e_max, 100, 1e-9);
}

TEST_F(FrameDifferenceTest, SizesMustAgree) {
  reference_.width = 100;
  EXPECT_THROW(Compare(), Error);
}

// L*a*b* of the sRGB primaries (D65): red (53.24, 80.09, 67.20), green (87.73, -86.18, 83.18).
TEST(DeltaE76, KnownColours) {
  EXPECT_NEAR(DeltaE76({1, 0, 0}, {0, 0, 0}),
              std::sqrt(53.24 * 53.24 + 80.09 * 80.09 + 67.20 * 67.20), 0.05);
  EXPECT_NEAR(DeltaE76({1, 0, 0}, {0, 1, 0}), std::hypot(34.49, 166.27, 15.98), 0.05);
  // Half of the light is L* 76.07; below the knee the curve is straight, 903.3 a unit.
  EXPECT_NEAR(DeltaE76({0.5, 0.5, 0.5}, {0, 0, 0}), 76.07, 0.01);
  EXPECT_NEAR(DeltaE76({0.001, 0.001, 0.001}, {0, 0, 0}), 0.9033, 0.001);
}

}  // namespace
}  // namespace sherd
