#include "metaball/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "metaball/error.h"

namespace sherd {
namespace {

TEST(Camera, AxesAreOrthonormalAndDownIsAwayFromUp) {
  const Camera c = Camera::LookAt({1, 2, 3}, {4, -1, 2}, {0, 0, 1}, 1.0, 640, 480);
  EXPECT_NEAR(Dot(c.right, c.down), 0, 1e-15);
  EXPECT_NEAR(Dot(c.right, c.forward), 0, 1e-15);
  EXPECT_NEAR(Length(c.down), 1, 1e-15);
  EXPECT_LT(c.down.z, 0);
  const Vec3d d = Cross(c.forward, c.right);
  EXPECT_NEAR(Length(d - c.down), 0, 1e-15);
}

TEST(Camera, RayThroughAPixelProjectsBackToIt) {
  for (const bool orthographic : {false, true}) {
    Camera c = orthographic
                   ? Camera::LookAtOrthographic({1, 2, 3}, {0, 0, 0}, {0, 0, 1}, 5, 200, 100)
                   : Camera::LookAt({1, 2, 3}, {0, 0, 0}, {0, 0, 1}, 0.9, 200, 100);
    c.cx += 7.25;  // principal points are seldom in the middle
    const RayD ray = RayThrough(c, 31.5, 77.25);
    EXPECT_NEAR(Length(ray.direction), 1, 1e-15);
    double x = 0, y = 0;
    ASSERT_TRUE(c.Project(ray.origin + ray.direction * 2.5, &x, &y));
    EXPECT_NEAR(x, 31.5, 1e-10);
    EXPECT_NEAR(y, 77.25, 1e-10);
  }
}

TEST(Camera, FieldOfViewSpansTheWidth) {
  const double fov = 55 * std::numbers::pi / 180;
  const Camera c = Camera::LookAt({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, fov, 1280, 720);
  const Vec3d left = RayThrough(c, 0, 360).direction, right = RayThrough(c, 1280, 360).direction;
  EXPECT_NEAR(std::acos(Dot(left, right)), fov, 1e-12);
}

TEST(Camera, CropAndResizeKeepTheRays) {
  const Camera c = Camera::LookAt({1, 2, 3}, {0, 0, 0}, {0, 0, 1}, 0.9, 200, 100);
  const Vec3d ray = RayThrough(c, 50, 60).direction;
  EXPECT_NEAR(Length(RayThrough(c.Cropped(40, 30, 20, 40), 10, 30).direction - ray), 0, 1e-14);
  EXPECT_NEAR(Length(RayThrough(c.Resized(600, 50), 150, 30).direction - ray), 0, 1e-14);
}

TEST(Camera, LookingAlongUpStillHasAxes) {
  const Camera c = Camera::LookAt({0, 0, 5}, {0, 0, 0}, {0, 0, 1}, 1.0, 10, 10);
  EXPECT_NEAR(Length(c.right), 1, 1e-12);
  EXPECT_NEAR(Dot(c.right, c.forward), 0, 1e-12);
}

TEST(Camera, ImpossibleViewsAreRefused) {
  EXPECT_THROW(Camera::LookAt({1, 1, 1}, {1, 1, 1}, {0, 0, 1}, 1, 10, 10), Error);
  EXPECT_THROW(Camera::LookAt({0, 0, 0}, {1, 1, 1}, {0, 0, 1}, 0, 10, 10), Error);
  EXPECT_THROW(Camera::LookAt({0, 0, 0}, {1, 1, 1}, {0, 0, 1}, 4, 10, 10), Error);
  EXPECT_THROW(Camera::LookAt({0, 0, 0}, {1, 1, 1}, {0, 0, 1}, 1, 0, 10), Error);
  EXPECT_THROW(Camera::LookAt({NAN, 0, 0}, {1, 1, 1}, {0, 0, 1}, 1, 10, 10), Error);
  EXPECT_THROW(Camera::LookAtOrthographic({0, 0, 0}, {1, 1, 1}, {0, 0, 1}, -1, 10, 10), Error);
}

}  // namespace
}  // namespace sherd
