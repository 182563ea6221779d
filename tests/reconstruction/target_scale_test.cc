// The scale from targets in photographs that are drawn here, of a board whose size is known.
#include "reconstruction/target_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <opencv2/aruco.hpp>

#include "metaball/error.h"
#include "reconstruction/camera_projector.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;
using namespace test;  // NOLINT

constexpr double kMetresPerUnit = 0.37;
const Vec3d kSomewhere{512345.25, 5412345.5, 210.75};  // a survey in UTM

// What is printed at (x, y) metres of the board, 0 black to 1 white; paper is white outside.
using Board = std::function<double(double x, double y)>;

// 10 x 7 squares of 4 cm.
double Chessboard(double x, double y) {
  const int column = static_cast<int>(std::floor(x / 0.04)),
            row = static_cast<int>(std::floor(y / 0.04));
  if (column < 0 || row < 0 || column > 9 || row > 6) return 1;
  return (column + row) % 2 == 0 ? 0 : 1;
}

// Markers 3 and 7 of 12 cm, side by side.
Board Markers() {
  cv::Mat a, b;
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50);
  cv::aruco::drawMarker(dictionary, 3, 6 * 20, a, 1);
  cv::aruco::drawMarker(dictionary, 7, 6 * 20, b, 1);
  return [a, b](double x, double y) {
    const cv::Mat& marker = x < 0.18 ? a : b;
    const double u = x < 0.18 ? x - 0.03 : x - 0.21, v = y - 0.06;
    const int column = static_cast<int>(std::floor(u / 0.001)),
              row = static_cast<int>(std::floor(v / 0.001));
    if (column < 0 || row < 0 || column > 119 || row > 119) return 1.0;
    return marker.at<std::uint8_t>(row, column) / 255.0;
  };
}

// Five photographs around the middle of the board, which lies in the plane z = 0 of the world.
Survey Photographs(const Board& board) {
  Survey survey;
  survey.cameras.push_back({1, CameraModelId::kPinhole, 640, 480, {700, 700, 321.5, 238.25}});
  const std::string folder = TestFolder();
  for (int i = 0; i < 5; ++i) {
    Photograph photo;
    photo.name = std::to_string(i) + ".pgm";
    photo.path = folder + "/" + photo.name;
    // From above, tilted by up to half a radian, turned by half a turn from one to the next.
    const double tilt = 0.12 * (i - 2), turn = i % 2 ? 3.14159265358979 : 0.2;
    Rigid3d& pose = photo.cam_from_world;
    const double h = 0.5 * tilt, t = 0.5 * turn;
    pose.qw = std::cos(h) * std::cos(t);
    pose.qx = std::sin(h) * std::cos(t);
    pose.qy = -std::sin(h) * std::sin(t);
    pose.qz = std::cos(h) * std::sin(t);
    const Vec3d middle = Vec3d{0.2, 0.14, 0} / kMetresPerUnit + kSomewhere;
    const Vec3d view = pose.InverseRotate({0, 0, 1});
    pose.translation = -pose.Rotate(middle - view * (0.6 / kMetresPerUnit));
    const CameraProjector projector(survey.cameras[0]);
    // The last file is a resize to half.
    const int scale = i == 4 ? 2 : 1, width = 640 / scale, height = 480 / scale;
    const int samples = 3 * scale;
    std::string pgm = "P5\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
    const Vec3d center = pose.Center() - kSomewhere;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (int k = 0; k < samples * samples; ++k) {
          Vec3d ray;
          projector.Unproject((x + (k % samples + 0.5) / samples) * scale,
                              (y + (k / samples + 0.5) / samples) * scale, &ray);
          ray = pose.InverseRotate(ray);
          const Vec3d p = (center - ray * (center.z / ray.z)) * kMetresPerUnit;
          sum += 40 + 180 * board(p.x, p.y);
        }
        pgm += static_cast<char>(std::lround(sum / (samples * samples)));
      }
    }
    WriteFile(photo.path, pgm);
    survey.photographs.push_back(photo);
  }
  return survey;
}

TEST(TargetScale, AChessboard) {
  const Survey survey = Photographs(Chessboard);
  TargetOptions options;
  options.columns = 9;
  options.rows = 6;
  options.size_m = 0.04;
  const TargetScale scale = ScaleFromTargets(options, survey);
  EXPECT_EQ(scale.photographs, 5u);
  EXPECT_EQ(scale.corners, 54u);
  EXPECT_EQ(scale.lengths, 15u);
  EXPECT_LT(scale.reprojection_px, 0.2);
  EXPECT_NEAR(scale.metres_per_unit / kMetresPerUnit, 1, 5e-4);
  EXPECT_LT(scale.relative_error, 5e-4);
  EXPECT_GT(scale.relative_error, 0);
  // Another board than the one that is there.
  options.columns = 8;
  options.rows = 11;
  EXPECT_THROW(ScaleFromTargets(options, survey), InputError);
}

TEST(TargetScale, Markers) {
  const Survey survey = Photographs(Markers());
  TargetOptions options;
  options.markers = "4x4_50";
  options.size_m = 0.12;
  TargetScale scale = ScaleFromTargets(options, survey);
  EXPECT_GE(scale.photographs, 4u);
  EXPECT_EQ(scale.corners, 8u);
  EXPECT_EQ(scale.lengths, 12u);
  // OpenCV places the outer corners of a marker about a sixth of a pixel inside it; a marker is 140
  // pixels wide here.
  EXPECT_NEAR(scale.metres_per_unit / kMetresPerUnit, 1, 4e-3);
  EXPECT_LT(scale.relative_error, 2e-3);
  // A photograph whose pose is wrong is outvoted.
  Survey wrong = survey;
  wrong.photographs[1].cam_from_world.translation.x += 0.1;
  scale = ScaleFromTargets(options, wrong);
  EXPECT_NEAR(scale.metres_per_unit / kMetresPerUnit, 1, 6e-3);
}

TEST(TargetScale, WhatCannotBeMeasuredSaysWhy) {
  Survey survey = Photographs([](double, double) { return 1.0; });
  TargetOptions options;
  options.markers = "4x4_50";
  options.size_m = 0.1;
  const auto error = [&] {
    try {
      ScaleFromTargets(options, survey);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error(), HasSubstr("no photograph shows such a target"));
  options.markers = "9x9";
  EXPECT_THAT(error(), HasSubstr("4x4_50"));
  options.markers = "4x4_50";
  options.size_m = 0;
  EXPECT_THAT(error(), HasSubstr("above 0 metres"));
  options.size_m = 0.1;
  options.markers.clear();
  options.columns = options.rows = 7;
  EXPECT_THAT(error(), HasSubstr("two different numbers"));
  options.columns = 6;
  WriteFile(survey.photographs[0].path, "no picture");
  EXPECT_THAT(error(), HasSubstr("no photograph"));
}

}  // namespace
}  // namespace sherd
