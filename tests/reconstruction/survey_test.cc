#include "reconstruction/survey.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

TEST(Survey, PosesTakeTheWorldToTheCamera) {
  // A quarter turn about z: the world's x axis is the camera's y axis.
  Rigid3d pose;
  pose.qw = pose.qz = std::sqrt(0.5);
  pose.translation = {1, 2, 3};
  const Vec3d p = pose.Apply({1, 0, 0});
  EXPECT_NEAR(p.x, 1, 1e-15);
  EXPECT_NEAR(p.y, 3, 1e-15);
  EXPECT_NEAR(p.z, 3, 1e-15);
  const Vec3d c = pose.Apply(pose.Center());
  EXPECT_NEAR(Length(c), 0, 1e-15);
  const Vec3d v{0.3, -2, 5};
  EXPECT_NEAR(Length(pose.InverseRotate(pose.Rotate(v)) - v), 0, 1e-14);
}

TEST(Survey, UpIsTheMeanOfThePhotographs) {
  std::vector<Photograph> photos(12);
  for (std::size_t i = 0; i < photos.size(); ++i) {
    photos[i].cam_from_world = test::PoseAt({0, 0, 0}, 0.5 * static_cast<double>(i));
  }
  const auto up = EstimateUp(photos);
  ASSERT_TRUE(up);
  EXPECT_NEAR(up->y, -1, 1e-12);
  EXPECT_FALSE(EstimateUp({}));
  // Half of them upside down.
  for (std::size_t i = 0; i < 6; ++i) {
    Rigid3d& pose = photos[i].cam_from_world;
    pose = {};
    pose.qw = 0;
    pose.qz = 1;
  }
  EXPECT_FALSE(EstimateUp(photos));
}

TEST(Survey, UpIsVerticalForTiltedAndOverheadPhotographs) {
  // Turned about the vertical y axis, then tilted down: by 30 degrees from the side, by 90 from
  // above.
  std::vector<Photograph> photos(12);
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const Rigid3d turned = test::PoseAt({0, 0, 0}, 0.5 * static_cast<double>(i));
    const double tilt = (i % 3 ? 30.0 : 90.0) * std::acos(-1.0) / 180;
    const double w = std::cos(tilt / 2), x = std::sin(tilt / 2);
    Rigid3d& pose = photos[i].cam_from_world;  // a rotation by `tilt` about x after `turned`
    pose.qw = w * turned.qw - x * turned.qx;
    pose.qx = w * turned.qx + x * turned.qw;
    pose.qy = w * turned.qy - x * turned.qz;
    pose.qz = w * turned.qz + x * turned.qy;
  }
  const auto up = EstimateUp(photos);
  ASSERT_TRUE(up);
  EXPECT_NEAR(up->y, -1, 1e-9);
}

TEST(Survey, RobustBoundsIgnoreStrays) {
  std::vector<Vec3d> points;
  for (int i = 0; i <= 1000; ++i) points.push_back({i * 0.001 + 5e6, -i * 0.002, 7});
  points.push_back({1e30, 1e30, -1e30});
  points.push_back({NAN, 0, 0});
  const Box3d box = RobustBounds(points);
  EXPECT_NEAR(box.min.x, 5e6 + 0.01 - 0.049, 2e-3);
  EXPECT_NEAR(box.max.x, 5e6 + 0.99 + 0.049, 2e-3);
  EXPECT_EQ(box.min.z, 7);
  EXPECT_EQ(box.max.z, 7);
  const Box3d none = RobustBounds({});
  EXPECT_EQ(none.min, (Vec3d{}));
  EXPECT_EQ(none.max, (Vec3d{}));
}

}  // namespace
}  // namespace sherd
