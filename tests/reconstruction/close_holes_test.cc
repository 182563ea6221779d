// Holes of a survey are closed where the surface around them says how, and only there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "reconstruction/level.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

constexpr double kSpacing = 0.01;

// Points strewn a spacing apart over surfaces that are given as heights over [0, 1]^2, under five
// photographs that list them all.
class Dig {
 public:
  Dig() {
    survey_.cameras.push_back({7, CameraModelId::kPinhole, 1000, 1000, {900, 900, 500, 500}});
    for (int i = 0; i < 5; ++i) {
      Photograph photo;  // looks down
      photo.cam_from_world = {0, 1, 0, 0, {}};
      const Vec3d center{0.3 + 0.1 * i, 0.5, 2};
      photo.cam_from_world.translation = -photo.cam_from_world.Rotate(center);
      survey_.photographs.push_back(photo);
    }
    survey_.points.photo_begin.push_back(0);
  }

  // keep(x, y): whether the survey has the place. up: 1 or -1, where the surface faces.
  Dig& Add(const std::function<double(double, double)>& height,
           const std::function<bool(double, double)>& keep, float up = 1) {
    std::uniform_real_distribution<double> uniform;
    SurveyPoints& p = survey_.points;
    constexpr double e = 1e-5;
    for (int i = 0; i < 100; ++i) {
      for (int j = 0; j < 100; ++j) {
        const double x = (i + 0.15 + 0.7 * uniform(random_)) * kSpacing;
        const double y = (j + 0.15 + 0.7 * uniform(random_)) * kSpacing;
        if (!keep(x, y)) continue;
        p.position.push_back({x, y, height(x, y)});
        const Vec3d normal{(height(x - e, y) - height(x + e, y)) / (2 * e),
                           (height(x, y - e) - height(x, y + e)) / (2 * e), 1};
        p.normal.push_back(Normalized(normal).cast<float>() * up);
        p.color.push_back(x < 0.5 ? Rgb8{200, 0, 0} : Rgb8{0, 200, 0});
        for (std::uint32_t k = 0; k < survey_.photographs.size(); ++k) p.photo_idx.push_back(k);
        p.photo_begin.push_back(p.photo_idx.size());
      }
    }
    return *this;
  }

  Survey& survey() { return survey_; }

 private:
  Survey survey_;
  std::mt19937_64 random_{3};
};

double Waves(double x, double y) { return 0.03 * std::sin(6 * x) * std::cos(5 * y); }

double FromMiddle(double x, double y) { return std::hypot(x - 0.5, y - 0.5); }

bool OutsideDisc(double x, double y) { return FromMiddle(x, y) > 5 * kSpacing; }

std::vector<Vec3d> ClosingPoints(const PreparedPoints& points) {
  return {points.points.position.end() - static_cast<std::ptrdiff_t>(points.closing),
          points.points.position.end()};
}

PreparedPoints Closed(const Survey& survey) {
  PreparedPoints points = PreparePoints(survey, false);
  CloseHoles(survey, &points);
  return points;
}

TEST(CloseHoles, AHoleIsFilledByTheSurfaceAroundIt) {
  Dig dig;
  dig.Add(Waves, OutsideDisc);
  const PreparedPoints closed = Closed(dig.survey());
  const std::vector<Vec3d> added = ClosingPoints(closed);
  // The disc has 79 of the survey's cells.
  EXPECT_GT(added.size(), 25u);
  EXPECT_LT(added.size(), 140u);
  for (const Vec3d& p : added) {
    EXPECT_LT(FromMiddle(p.x, p.y), 5.5 * kSpacing);
    EXPECT_LT(std::abs(p.z - Waves(p.x, p.y)), 0.15 * kSpacing) << p.x << " " << p.y;
  }
  // No place of it is left open.
  for (double x = 0.45; x < 0.55; x += 0.002) {
    for (double y = 0.45; y < 0.55; y += 0.002) {
      double nearest = 1;
      for (const Vec3d& p : closed.points.position) {
        nearest = std::min(nearest, std::hypot(p.x - x, p.y - y));
      }
      EXPECT_LT(nearest, 1.5 * kSpacing) << x << " " << y;
    }
  }
  // What is known of them is what is known of the points beside them.
  const SurveyPoints& points = closed.points;
  ASSERT_EQ(points.photo_begin.size(), points.size() + 1);
  ASSERT_EQ(closed.spacing.size(), points.size());
  for (std::size_t i = closed.surveyed(); i < points.size(); ++i) {
    EXPECT_EQ(points.photo_begin[i + 1] - points.photo_begin[i], 5u);
    EXPECT_GT(Dot(points.normal[i], Vec3f{0, 0, 1}), 0.9f);
    EXPECT_NEAR(closed.spacing[i], kSpacing, 0.5 * kSpacing);
    const bool left = points.position[i].x < 0.5 - 2 * kSpacing;
    const bool right = points.position[i].x > 0.5 + 2 * kSpacing;
    if (left) {
      EXPECT_EQ(points.color[i].r, 200);
    }
    if (right) {
      EXPECT_EQ(points.color[i].g, 200);
    }
  }
}

TEST(CloseHoles, ASurfaceWithoutHolesStaysAsItIs) {
  Dig dig;
  dig.Add(Waves, [](double, double) { return true; });
  EXPECT_EQ(Closed(dig.survey()).closing, 0u);
  // An edge of a right angle, and a border that is notched.
  Dig edge;
  edge.Add([](double x, double) { return std::abs(x - 0.5); },
           [](double x, double y) { return y < 0.9 + 0.05 * std::sin(40 * x); });
  EXPECT_EQ(Closed(edge.survey()).closing, 0u);
}

TEST(CloseHoles, WhatIsTooWideStaysOpenInTheMiddle) {
  Dig dig;
  dig.Add(Waves, [](double x, double y) { return FromMiddle(x, y) > 20 * kSpacing; });
  for (const Vec3d& p : ClosingPoints(Closed(dig.survey()))) {
    EXPECT_GT(FromMiddle(p.x, p.y), 11 * kSpacing);
  }
}

TEST(CloseHoles, WhatPhotographsSeeThroughStaysOpen) {
  Dig dig;
  dig.Add(Waves, OutsideDisc);
  // The ground below, as far as it is seen through the hole.
  dig.Add([](double, double) { return -0.3; },
          [](double x, double y) { return FromMiddle(x, y) < 12 * kSpacing; });
  EXPECT_EQ(Closed(dig.survey()).closing, 0u);
}

TEST(CloseHoles, AHoleThroughAThinPlateStaysOpen) {
  Dig dig;
  dig.Add([](double, double) { return 0.0; }, OutsideDisc);
  dig.Add([](double, double) { return -2 * kSpacing; }, OutsideDisc, -1);
  for (const Vec3d& p : ClosingPoints(Closed(dig.survey()))) {
    // A point on either face, if anything: none between them.
    EXPECT_LT(std::min(std::abs(p.z), std::abs(p.z + 2 * kSpacing)), 0.3 * kSpacing);
  }
}

TEST(CloseHoles, NothingIsAddedWhereNothingIsKnownOfThePhotographs) {
  Dig dig;
  dig.Add(Waves, OutsideDisc);
  Survey survey = dig.survey();
  survey.points.photo_begin.clear();
  survey.points.photo_idx.clear();
  EXPECT_EQ(Closed(survey).closing, 0u);
}

TEST(CloseHoles, TheOptionDecidesAndTheLevelSaysWhatWasAdded) {
  Dig dig;
  dig.Add(Waves, OutsideDisc);
  LevelOptions options;
  options.target_count = 4000;
  options.close_holes = false;
  const Survey& survey = dig.survey();
  const Level open = BuildLevel(PrepareForLevels(survey.points, survey, options), survey, options);
  EXPECT_EQ(open.stats.closing_points, 0u);
  EXPECT_EQ(open.cloud.FindChannel(kSurveyedChannel), nullptr);

  options.close_holes = true;
  const PreparedPoints points = PrepareForLevels(survey.points, survey, options);
  const Level closed = BuildLevel(points, survey, options);
  EXPECT_EQ(closed.stats.closing_points, points.closing);
  EXPECT_EQ(closed.stats.source_points, survey.points.size());
  const Channel* const surveyed = closed.cloud.FindChannel(kSurveyedChannel);
  ASSERT_NE(surveyed, nullptr);
  int added = 0;
  for (std::size_t i = 0; i < closed.cloud.size(); ++i) {
    const Vec3d p = closed.cloud.frame.WorldFromLocal(closed.cloud.center[i]);
    const float share = surveyed->Get(i).v[0];
    if (FromMiddle(p.x, p.y) < 3 * kSpacing) {
      EXPECT_EQ(share, 0) << p.x << " " << p.y;
    }
    if (FromMiddle(p.x, p.y) > 8 * kSpacing) {
      EXPECT_EQ(share, 1) << p.x << " " << p.y;
    }
    added += share == 0;
  }
  EXPECT_GT(added, 10);
  // What was added was measured nowhere: the errors are those of the survey's points.
  EXPECT_NEAR(closed.stats.error_mean, open.stats.error_mean, 0.1 * open.stats.error_mean);

  const PreparedPoints again = PrepareForLevels(survey.points, survey, options);
  EXPECT_EQ(again.points.position, points.points.position);
}

TEST(CloseHoles, CancellingLeavesThePointsAsTheyWere) {
  Dig dig;
  dig.Add(Waves, OutsideDisc);
  PreparedPoints points = PreparePoints(dig.survey(), false);
  const std::vector<Vec3d> before = points.points.position;
  std::stop_source stop;
  stop.request_stop();
  Control control;
  control.stop = stop.get_token();
  EXPECT_THROW(CloseHoles(dig.survey(), &points, control), Cancelled);
  EXPECT_EQ(points.points.position, before);
  EXPECT_EQ(points.closing, 0u);
}

}  // namespace
}  // namespace sherd
