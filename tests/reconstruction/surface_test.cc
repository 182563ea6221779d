// A level's surface lies on the points it was made from.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "reconstruction/level.h"
#include "reconstruction/surface_field.h"

namespace sherd {
namespace {

struct Sheet {
  Survey survey;
  double spacing = 0;  // of a level that holds a seventh of the points
};

// n points on [0, 1]^2 lifted by `height`, facing up, with noise along z.
Sheet HeightField(int n, const std::function<double(double, double)>& height, double noise,
                  bool below = false) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> gauss;
  Sheet out;
  out.spacing = std::sqrt(7.0 / n);
  SurveyPoints& p = out.survey.points;
  for (int i = 0; i < n; ++i) {
    const double x = uniform(random), y = uniform(random), e = 1e-5;
    p.position.push_back({x, y, height(x, y) + noise * gauss(random)});
    const Vec3d normal = Normalized(Vec3d{(height(x - e, y) - height(x + e, y)) / (2 * e),
                                          (height(x, y - e) - height(x, y + e)) / (2 * e), 1});
    p.normal.push_back((below ? -normal : normal).cast<float>());
  }
  return out;
}

Level Build(const Survey& survey, std::uint64_t target) {
  LevelOptions options;
  options.target_count = target;
  return BuildLevel(PreparePoints(survey, false), survey, options);
}

// The height at which a ray from above meets the surface over (x, y); NaN where it does not.
double TopAt(const Level& level, const SurfaceField& field, double x, double y, double from,
             double to) {
  const auto inside = [&](double z) {
    const Vec3f p = level.cloud.frame.LocalFromWorld({x, y, z}).cast<float>();
    return field.At(p).field >= static_cast<float>(level.stats.threshold);
  };
  constexpr int kSteps = 400;
  for (int i = 1; i <= kSteps; ++i) {
    double above = from + (to - from) * (i - 1) / kSteps, below = from + (to - from) * i / kSteps;
    if (!inside(below)) continue;
    for (int k = 0; k < 20; ++k) {
      const double middle = (above + below) / 2;
      (inside(middle) ? below : above) = middle;
    }
    return (above + below) / 2;
  }
  return NAN;
}

struct Deviation {
  double mean = 0, rms = 0;
  int open = 0;
};

Deviation DeviationOf(const Level& level, const std::function<double(double, double)>& height) {
  const SurfaceField field(level.cloud);
  Deviation out;
  int count = 0;
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) {
      const double x = 0.08 + 0.84 * i / 59, y = 0.08 + 0.84 * j / 59;
      const double truth = height(x, y);
      const double top = TopAt(level, field, x, y, truth + 0.2, truth - 0.2);
      if (std::isnan(top)) {
        ++out.open;
        continue;
      }
      out.mean += top - truth;
      out.rms += (top - truth) * (top - truth);
      ++count;
    }
  }
  out.mean /= count;
  out.rms = std::sqrt(out.rms / count);
  return out;
}

TEST(Surface, LiesOnAPlane) {
  const auto flat = [](double, double) { return 0.3; };
  const Sheet sheet = HeightField(28000, flat, 0.0);
  const Level level = Build(sheet.survey, 4000);
  const Deviation d = DeviationOf(level, flat);
  EXPECT_EQ(d.open, 0);
  EXPECT_LT(std::abs(d.mean), 0.02 * sheet.spacing);
  EXPECT_LT(d.rms, 0.05 * sheet.spacing);
}

TEST(Surface, LiesOnACurvedSheetThroughTheNoise) {
  const auto waves = [](double x, double y) { return 0.05 * std::sin(6 * x) * std::cos(5 * y); };
  const double noise = 0.2 * std::sqrt(7.0 / 28000);
  const Sheet sheet = HeightField(28000, waves, noise);
  const Level level = Build(sheet.survey, 4000);
  const Deviation d = DeviationOf(level, waves);
  EXPECT_EQ(d.open, 0);
  EXPECT_LT(std::abs(d.mean), 0.09 * sheet.spacing);
  EXPECT_LT(d.rms, 0.16 * sheet.spacing) << "the noise of a point is 0.2";
  // The points' mean distance from a surface without error is 0.8 of the noise.
  EXPECT_GT(level.stats.error_mean, 0.6 * noise);
  EXPECT_LT(level.stats.error_mean, 1.1 * noise);
  EXPECT_GT(level.stats.error_p95, 1.7 * noise);
  EXPECT_LT(level.stats.error_p95, 2.4 * noise);
  EXPECT_GT(level.stats.error_max, level.stats.error_p95);
}

double RmsDistance(const SurveyPoints& points,
                   const std::function<double(double, double)>& height) {
  double sum = 0;
  int count = 0;
  for (const Vec3d& p : points.position) {
    if (p.x < 0.05 || p.x > 0.95 || p.y < 0.05 || p.y > 0.95) continue;
    sum += (p.z - height(p.x, p.y)) * (p.z - height(p.x, p.y));
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(Surface, NoiseIsSmoothedAndASurfaceWithoutNoiseStays) {
  const auto waves = [](double x, double y) { return 0.05 * std::sin(6 * x) * std::cos(5 * y); };
  const double noise = 0.2 * std::sqrt(7.0 / 28000);
  const Sheet sheet = HeightField(28000, waves, noise);
  PreparedPoints points = PreparePoints(sheet.survey, false);
  const SurveyPoints before = points.points;
  SmoothNoise(false, &points);
  EXPECT_NEAR(RmsDistance(before, waves), noise, 0.02 * noise);
  EXPECT_LT(RmsDistance(points.points, waves), 0.35 * noise);
  for (std::size_t i = 0; i < before.size(); ++i) {
    ASSERT_LT(Length(points.SurveyedPosition(i) - before.position[i]), 1e-7);
  }
  LevelOptions options;
  options.target_count = 4000;
  const Deviation d = DeviationOf(BuildLevel(points, sheet.survey, options), waves);
  EXPECT_EQ(d.open, 0);
  EXPECT_LT(std::abs(d.mean), 0.03 * sheet.spacing);
  EXPECT_LT(d.rms, 0.08 * sheet.spacing);

  const Sheet clean = HeightField(28000, waves, 0.0);
  PreparedPoints same = PreparePoints(clean.survey, false);
  SmoothNoise(false, &same);
  EXPECT_LT(RmsDistance(same.points, waves), 0.02 * noise);
}

// Two walls that meet in a right angle: nothing is rounded farther than the noise.
TEST(Surface, AnEdgeStaysSharpThroughTheSmoothing) {
  const auto step = [](double x, double) { return -std::abs(x - 0.5); };
  const double noise = 0.05 * std::sqrt(1.0 / 28000);
  const Sheet sheet = HeightField(28000, step, noise);
  PreparedPoints points = PreparePoints(sheet.survey, false);
  SmoothNoise(true, &points);
  EXPECT_LT(points.outliers, 20u) << "of 28 000 points";
  double largest = 0;
  for (const Vec3d& p : points.points.position) {
    largest = std::max(largest, std::abs(p.z - step(p.x, p.y)));
  }
  EXPECT_LT(largest, 0.5 * std::sqrt(1.0 / 28000));
}

// Lone points over a sheet, too few to be a surface of their own, and ones on it.
TEST(Surface, LonePointsStandOutOfASmoothedSheet) {
  const auto waves = [](double x, double y) { return 0.05 * std::sin(6 * x) * std::cos(5 * y); };
  const double spacing = std::sqrt(1.0 / 28000);
  Sheet sheet = HeightField(28000, waves, 0.1 * spacing);
  SurveyPoints& p = sheet.survey.points;
  const std::size_t surface = p.size(), lone = 100;
  for (std::size_t i = 0; i < lone; ++i) {
    const double x = 0.1 + 0.08 * static_cast<double>(i % 10) + 0.003;
    const double y = 0.1 + 0.08 * static_cast<double>(i / 10) + 0.003;
    p.position.push_back({x, y, waves(x, y) + (2 + 0.02 * static_cast<double>(i)) * spacing});
    p.normal.push_back({0, 0, 1});
    if (!p.color.empty()) p.color.push_back({});
  }
  for (const bool remove : {false, true}) {
    PreparedPoints points = PreparePoints(sheet.survey, false);
    SmoothNoise(remove, &points);
    EXPECT_EQ(points.outliers, remove ? lone : 0);
    EXPECT_EQ(points.points.size(), surface + (remove ? 0 : lone));
    EXPECT_EQ(points.spacing.size(), points.points.size());
    EXPECT_EQ(points.shift.size(), points.points.size());
    if (remove) {
      EXPECT_LT(RmsDistance(points.points, waves), 0.05 * spacing);
    }
  }
}

TEST(Surface, MetaballsThatStandForFewPointsOverlapMore) {
  const auto flat = [](double, double) { return 0.0; };
  const Sheet sheet = HeightField(6000, flat, 0.0);
  const PreparedPoints points = PreparePoints(sheet.survey, false);
  const auto overlap = [&](std::uint64_t count, double factor) {
    LevelOptions options;
    options.target_count = count;
    options.radius_factor = factor;
    const LevelStats stats = BuildLevel(points, sheet.survey, options).stats;
    return stats.radius_median / stats.spacing;
  };
  EXPECT_NEAR(overlap(1000, 0), 1.8, 0.1);
  EXPECT_NEAR(overlap(2400, 0), 2.1, 0.1);  // of 2.5 points each
  EXPECT_NEAR(overlap(6000, 0), 2.4, 0.1);
  EXPECT_NEAR(overlap(6000, 1.8), 1.8, 0.1);
}

// A cloud that fills space has no surface to be moved onto; a few points have no surroundings.
TEST(Surface, WhatIsNoSurfaceStays) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform;
  for (const int n : {1, 10, 3000}) {
    Survey survey;
    for (int i = 0; i < n; ++i) {
      survey.points.position.push_back({uniform(random), uniform(random), uniform(random)});
    }
    PreparedPoints points = PreparePoints(survey, false);
    SmoothNoise(false, &points);
    const auto moved =
        std::count_if(points.shift.begin(), points.shift.end(), [](float s) { return s != 0; });
    EXPECT_LT(moved, n / 5 + 1) << n;
  }
}

// Thinner than a sheet's metaballs reach: the centres stay within the wall, and the surface on
// either side is nearer to the truth than it was when they lay on the points.
TEST(Surface, AThinWallStaysThin) {
  const double thickness = 0.02;
  const auto top = [](double, double) { return 0.02; };
  const auto bottom = [](double, double) { return 0.0; };
  Sheet wall = HeightField(14000, top, 0.0);
  const Sheet back = HeightField(14000, bottom, 0.0, true);
  SurveyPoints& p = wall.survey.points;
  p.position.insert(p.position.end(), back.survey.points.position.begin(),
                    back.survey.points.position.end());
  p.normal.insert(p.normal.end(), back.survey.points.normal.begin(),
                  back.survey.points.normal.end());
  const Level level = Build(wall.survey, 4000);
  const double spacing = std::sqrt(2.0 / 4000);
  ASSERT_LT(thickness, spacing);
  int outside = 0;
  for (std::size_t i = 0; i < level.cloud.size(); ++i) {
    const Vec3d c = level.cloud.frame.WorldFromLocal(level.cloud.center[i]);
    if (c.x < 0.1 || c.x > 0.9 || c.y < 0.1 || c.y > 0.9) continue;
    outside += !(c.z > 0.2 * thickness && c.z < 0.8 * thickness);
  }
  // Cells that hold points of both faces do not know which way they look.
  EXPECT_LE(outside, 4);
  const Deviation d = DeviationOf(level, top);
  EXPECT_EQ(d.open, 0);
  EXPECT_LT(d.mean, 0.85 * spacing);
}

TEST(Surface, DistanceToOneMetaball) {
  CloudInput input;
  input.center = {{1, 2, 3}};
  input.radius = {2.0};
  const Cloud cloud = BuildCloud(input);
  const SurfaceField field(cloud);
  const double unit = cloud.frame.unit;
  // (1 - d^2 / 4)^2 = 0.25 at d = sqrt 2.
  const auto distance = [&](const Vec3d& p) {
    return unit * static_cast<double>(field.SignedDistance(
                      cloud.frame.LocalFromWorld(p).cast<float>(), {0, 0, 1}, 0.25f, 0));
  };
  const double surface = std::sqrt(2.0);
  EXPECT_NEAR(distance({1, 2, 3 + surface}), 0, 2e-3);
  EXPECT_NEAR(distance({1, 2, 4.9}), 1.9 - surface, 4e-3) << "within the support";
  EXPECT_NEAR(distance({1, 2, 8}), 5 - surface, 4e-3) << "outside it";
  EXPECT_NEAR(distance({1, 2.5, 3}), 0.5 - surface, 4e-3) << "inside";
  EXPECT_NEAR(distance({1, 2, 3}), -surface, 4e-3) << "at the centre, which has no slope";
}

// Nothing of the errors depends on where in the world the survey lies.
TEST(Surface, ErrorsFarFromTheOrigin) {
  const auto flat = [](double, double) { return 0.3; };
  Sheet sheet = HeightField(7000, flat, 0.001);
  const Level near = Build(sheet.survey, 1000);
  for (Vec3d& p : sheet.survey.points.position) p += Vec3d{500000, 4649000, 128};
  const Level far = Build(sheet.survey, 1000);
  EXPECT_NEAR(near.stats.error_mean, far.stats.error_mean, 1e-2 * near.stats.error_mean);
  EXPECT_NEAR(near.stats.error_p95, far.stats.error_p95, 1e-2 * near.stats.error_p95);
}

}  // namespace
}  // namespace sherd
