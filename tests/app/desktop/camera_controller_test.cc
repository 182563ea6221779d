#include "app/desktop/camera_controller.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace sherd {
namespace {

constexpr int kWidth = 640, kHeight = 480;

CameraController MakeController(Projection projection) {
  CameraController controller;
  controller.SetScene({{-2, -1, 3}, {4, 5, 4}}, {0, 0, 1});
  controller.SetProjection(projection);
  controller.LookAlong(Camera::LookAt({0, -5, 3}, {0, 0, 0}, {0, 0, 1}, 0.8, kWidth, kHeight),
                       kWidth, kHeight);
  return controller;
}

void ExpectOrthonormal(const CameraState& s) {
  EXPECT_NEAR(Length(s.right), 1, 1e-12);
  EXPECT_NEAR(Length(s.down), 1, 1e-12);
  EXPECT_NEAR(Length(s.forward), 1, 1e-12);
  EXPECT_NEAR(Dot(s.right, s.forward), 0, 1e-12);
  EXPECT_NEAR(Length(Cross(s.forward, s.right) - s.down), 0, 1e-12);
}

class BothProjections : public testing::TestWithParam<Projection> {};
INSTANTIATE_TEST_SUITE_P(Camera, BothProjections,
                         testing::Values(Projection::kPerspective, Projection::kOrthographic),
                         [](const auto& p) {
                           return p.param == Projection::kPerspective ? "Perspective"
                                                                      : "Orthographic";
                         });

TEST_P(BothProjections, FitShowsTheWholeSceneAndFillsTheView) {
  for (const auto& [width, height] : {std::pair(640, 480), {300, 900}, {1200, 200}}) {
    CameraController controller = MakeController(GetParam());
    controller.Fit(width, height);
    const Camera camera = controller.MakeCamera(width, height);
    const Box3d& box = controller.bounds();
    double nearest_edge = 1e9;
    for (int i = 0; i < 8; ++i) {
      const Vec3d corner = {i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                            i & 4 ? box.max.z : box.min.z};
      double x, y;
      ASSERT_TRUE(camera.Project(corner, &x, &y));
      nearest_edge = std::min({nearest_edge, x / width, 1 - x / width, y / height, 1 - y / height});
    }
    EXPECT_GE(nearest_edge, 0.0) << width << "x" << height;
    EXPECT_LT(nearest_edge, 0.06) << width << "x" << height;
  }
}

TEST_P(BothProjections, FitFramesTheShapeAndNotItsStrays) {
  CameraController controller = MakeController(GetParam());
  auto shape = std::make_shared<std::vector<Vec3d>>();
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 3000; ++i) {  // a ball off the middle of the bounds
    const Vec3d v{normal(random), normal(random), normal(random)};
    shape->push_back(Vec3d{1.5, 3.0, 3.4} + Normalized(v) * 0.4);
  }
  shape->push_back({900, 0, 0});
  controller.SetShape(shape);
  controller.Fit(kWidth, kHeight);
  const Camera camera = controller.MakeCamera(kWidth, kHeight);
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (std::size_t i = 0; i + 1 < shape->size(); ++i) {
    double x, y;
    ASSERT_TRUE(camera.Project((*shape)[i], &x, &y));
    left = std::min(left, x);
    right = std::max(right, x);
    top = std::min(top, y);
    bottom = std::max(bottom, y);
  }
  EXPECT_NEAR(0.5 * (left + right), 0.5 * kWidth, 0.02 * kWidth);
  EXPECT_NEAR(0.5 * (top + bottom), 0.5 * kHeight, 0.02 * kHeight);
  EXPECT_GT(bottom - top, 0.88 * kHeight);
  EXPECT_LT(bottom - top, 1.0 * kHeight);
}

TEST_P(BothProjections, OrbitKeepsThePivotInItsPlace) {
  CameraController controller = MakeController(GetParam());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(-0.5, 0.5);
  const Vec3d pivot{1.3, 0.4, 3.6};
  double x0, y0;
  ASSERT_TRUE(controller.MakeCamera(kWidth, kHeight).Project(pivot, &x0, &y0));
  for (int i = 0; i < 200; ++i) {
    controller.Orbit(angle(random), angle(random), pivot);
    double x, y;
    ASSERT_TRUE(controller.MakeCamera(kWidth, kHeight).Project(pivot, &x, &y));
    EXPECT_NEAR(x, x0, 1e-6);
    EXPECT_NEAR(y, y0, 1e-6);
    // The horizon stays level and the scene upright.
    EXPECT_NEAR(Dot(controller.state().right, controller.up()), 0, 1e-9);
    EXPECT_LE(Dot(controller.state().down, controller.up()), 1e-9);
    ExpectOrthonormal(controller.state());
  }
}

TEST(CameraController, OrbitTurnsTheSceneWithTheMouse) {
  CameraController controller = MakeController(Projection::kPerspective);
  const Vec3d center = controller.bounds().Center();
  const Vec3d front = controller.state().eye();
  const auto place_of_front = [&](double* x, double* y) {
    const Vec3d point = center + Normalized(front - center) * 0.5;
    return controller.MakeCamera(kWidth, kHeight).Project(point, x, y);
  };
  double x0, y0, x, y;
  ASSERT_TRUE(place_of_front(&x0, &y0));
  controller.Orbit(0.2, 0, center);
  ASSERT_TRUE(place_of_front(&x, &y));
  EXPECT_GT(x, x0 + 1);  // what is in front moves to the right with the mouse
  controller = MakeController(Projection::kPerspective);
  controller.Orbit(0, 0.2, center);
  ASSERT_TRUE(place_of_front(&x, &y));
  EXPECT_GT(y, y0 + 1);  // and down
  EXPECT_GT(controller.state().eye().z, front.z);
}

TEST(CameraController, OrbitStopsAtThePoles) {
  CameraController controller = MakeController(Projection::kPerspective);
  const Vec3d center = controller.bounds().Center();
  controller.Orbit(0, 10, center);
  EXPECT_NEAR(Dot(controller.state().forward, {0, 0, -1}), 1, 1e-9);
  controller.Orbit(0, -10, center);
  EXPECT_NEAR(Dot(controller.state().forward, {0, 0, 1}), 1, 1e-9);
}

TEST_P(BothProjections, ZoomKeepsThePointUnderTheCursor) {
  CameraController controller = MakeController(GetParam());
  const Vec3d anchor{-1.1, 2.2, 3.9};
  double x0, y0;
  ASSERT_TRUE(controller.MakeCamera(kWidth, kHeight).Project(anchor, &x0, &y0));
  const double size0 =
      controller.MakeCamera(kWidth, kHeight).PixelSizeAt(controller.state().distance);
  for (int i = 0; i < 30; ++i) controller.ZoomAt(anchor, 0.9);
  double x, y;
  ASSERT_TRUE(controller.MakeCamera(kWidth, kHeight).Project(anchor, &x, &y));
  EXPECT_NEAR(x, x0, 1e-6);
  EXPECT_NEAR(y, y0, 1e-6);
  const double size =
      controller.MakeCamera(kWidth, kHeight).PixelSizeAt(controller.state().distance);
  EXPECT_NEAR(size, size0 * std::pow(0.9, 30), 1e-9 * size0);
}

TEST(CameraController, ZoomHasLimits) {
  CameraController controller = MakeController(Projection::kPerspective);
  const Vec3d anchor = controller.bounds().Center();
  for (int i = 0; i < 2000; ++i) controller.ZoomAt(anchor, 0.5);
  EXPECT_GT(controller.state().distance, 0);
  for (int i = 0; i < 2000; ++i) controller.ZoomAt(anchor, 2);
  EXPECT_LT(controller.state().distance, 1e4);
  const double before = controller.state().distance;
  controller.ZoomAt(anchor, 0);
  controller.ZoomAt(anchor, std::nan(""));
  EXPECT_EQ(controller.state().distance, before);
}

TEST_P(BothProjections, PanMovesThePointWithTheCursor) {
  CameraController controller = MakeController(GetParam());
  const Vec3d anchor{0.7, 1.9, 3.2};
  double x0, y0, x, y;
  ASSERT_TRUE(controller.MakeCamera(kWidth, kHeight).Project(anchor, &x0, &y0));
  controller.Pan(37, -21, anchor, kWidth, kHeight);
  ASSERT_TRUE(controller.MakeCamera(kWidth, kHeight).Project(anchor, &x, &y));
  EXPECT_NEAR(x, x0 + 37, 1e-6);
  EXPECT_NEAR(y, y0 - 21, 1e-6);
}

TEST(CameraController, ProjectionsAgreeAtTheTarget) {
  CameraController controller = MakeController(Projection::kPerspective);
  const double depth = controller.state().distance;
  const double perspective = controller.MakeCamera(kWidth, kHeight).PixelSizeAt(depth);
  controller.SetProjection(Projection::kOrthographic);
  EXPECT_NEAR(controller.MakeCamera(kWidth, kHeight).PixelSizeAt(0), perspective,
              1e-12 * perspective);
  controller.SetViewAngle(0.3);
  EXPECT_NEAR(controller.MakeCamera(kWidth, kHeight).PixelSizeAt(0), perspective,
              1e-9 * perspective);
}

TEST(CameraController, OrthographicEyeLiesInFrontOfTheWholeScene) {
  CameraController controller = MakeController(Projection::kOrthographic);
  const Vec3d anchor = controller.bounds().min;
  for (int i = 0; i < 60; ++i) controller.ZoomAt(anchor, 0.8);
  const Camera camera = controller.MakeCamera(kWidth, kHeight);
  const Box3d& box = controller.bounds();
  for (int i = 0; i < 8; ++i) {
    const Vec3d corner = {i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                          i & 4 ? box.max.z : box.min.z};
    EXPECT_GT(Dot(corner - camera.eye, camera.forward), 0);
  }
}

TEST(CameraController, PhotographKeepsItsRaysInAnyWindow) {
  CameraController controller = MakeController(Projection::kOrthographic);
  Camera photo = Camera::LookAt({3, -6, 7}, {1, 2, 3.5}, {0, 0, 1}, 0.9, 4000, 3000);
  photo.fy *= 1.01;  // not quite square pixels, a principal point off the middle
  photo.cx += 40;
  photo.cy -= 25;
  controller.LookThrough(photo);
  EXPECT_EQ(controller.state().projection, Projection::kPerspective);
  for (const auto& [width, height] : {std::pair(800, 600), {500, 900}, {1500, 300}}) {
    const Camera camera = controller.MakeCamera(width, height);
    const double scale = std::min(width / 4000.0, height / 3000.0);
    const double left = 0.5 * (width - 4000 * scale), top = 0.5 * (height - 3000 * scale);
    for (const auto& [x, y] : {std::pair(0.0, 0.0), {4000.0, 3000.0}, {1234.5, 777.25}}) {
      const RayD expected = RayThrough(photo, x, y);
      const RayD ray = RayThrough(camera, left + x * scale, top + y * scale);
      EXPECT_NEAR(Length(ray.origin - expected.origin), 0, 1e-9);
      EXPECT_NEAR(Length(ray.direction - expected.direction), 0, 1e-12);
    }
  }
  // An orbit goes on from there without a jump; a fit leaves the photograph.
  controller.Orbit(0.01, 0, controller.bounds().Center());
  EXPECT_TRUE(controller.state().film);
  controller.Fit(kWidth, kHeight);
  EXPECT_FALSE(controller.state().film);
}

TEST(CameraController, PointAtTargetDepthProjectsBack) {
  for (const Projection projection : {Projection::kPerspective, Projection::kOrthographic}) {
    CameraController controller = MakeController(projection);
    const Vec3d p = controller.PointAtTargetDepth(123, 321, kWidth, kHeight);
    double x, y;
    ASSERT_TRUE(controller.MakeCamera(kWidth, kHeight).Project(p, &x, &y));
    EXPECT_NEAR(x, 123, 1e-6);
    EXPECT_NEAR(y, 321, 1e-6);
    EXPECT_NEAR(Dot(p - controller.state().target, controller.state().forward), 0, 1e-9);
  }
}

TEST(CameraController, DegenerateScenesStillGiveACamera) {
  CameraController controller;
  controller.SetScene({{5, 5, 5}, {5, 5, 5}}, {0, 0, 0});
  controller.Fit(100, 100);
  EXPECT_GT(controller.state().distance, 0);
  const Camera camera = controller.MakeCamera(100, 100);
  EXPECT_TRUE(std::isfinite(camera.fx) && camera.fx > 0);
}

}  // namespace
}  // namespace sherd
