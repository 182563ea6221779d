// Preparation and density levels.
#include "reconstruction/level.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>
#include <set>

#include "metaball/error.h"
#include "reconstruction/downsample.h"
#include "reconstruction/workspace.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;

// A wavy sheet of 2 x 1 with a little noise, seen by three cameras above it (looking along +z, the
// sheet at z = 4: the side towards them is -z).
Survey WavySheet(int n, double noise = 0.0005, double height = 0.05) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Survey s;
  s.cameras.push_back({1, CameraModelId::kPinhole, 640, 480, {500, 500, 320, 240}});
  for (int i = 0; i < 3; ++i) {
    Photograph photo;
    photo.cam_from_world = test::PoseAt({0.5 + 0.5 * i, 0.5, 0});
    s.photographs.push_back(photo);
  }
  SurveyPoints& p = s.points;
  p.photo_begin.push_back(0);
  const int columns = static_cast<int>(std::sqrt(2.0 * n));
  for (int i = 0; i < n; ++i) {
    const double x = (i % columns + uniform(random)) / columns * 2;
    const double y = (i / columns + uniform(random)) / (n / columns);
    p.position.push_back(
        {x, y, 4 + height * std::sin(6 * x) * std::cos(5 * y) + noise * normal(random)});
    p.color.push_back({static_cast<std::uint8_t>(x < 1 ? 255 : 0), 0, 100});
    p.photo_idx.push_back(x < 1 ? 0 : 2);
    p.photo_idx.push_back(1);
    p.photo_begin.push_back(p.photo_idx.size());
  }
  return s;
}

Level Build(const PreparedPoints& points, const Survey& survey, std::uint64_t target) {
  LevelOptions options;
  options.target_count = target;
  return BuildLevel(points, survey, options);
}

TEST(Count, TextAndBack) {
  EXPECT_EQ(ParseCount("63k"), 63000u);
  EXPECT_EQ(ParseCount("63K"), 63000u);
  EXPECT_EQ(ParseCount("1.5M"), 1500000u);
  EXPECT_EQ(ParseCount("1.5m"), 1500000u);
  EXPECT_EQ(ParseCount("500"), 500u);
  EXPECT_EQ(ParseCount("0.063k"), 63u);
  EXPECT_EQ(ParseCount("63.0000k"), 63000u);
  EXPECT_EQ(FormatCount(63000), "63k");
  EXPECT_EQ(FormatCount(1500000), "1.5M");
  EXPECT_EQ(FormatCount(62500), "62.5k");
  EXPECT_EQ(FormatCount(500), "500");
  EXPECT_EQ(FormatCount(1000000), "1M");
  for (const std::uint64_t n :
       {1ull, 999ull, 1001ull, 63334ull, 999999ull, 1000001ull, 1234567ull, 5000000000ull}) {
    EXPECT_EQ(ParseCount(FormatCount(n)), n) << FormatCount(n);
  }
  for (const char* bad : {"", "k", "0", "0k", "-5", "5x", "1.2.3k", "1.5", "0.0005k", "63 k", "1e3",
                          "99999999999999999999", "9999999M", "."}) {
    EXPECT_THROW(ParseCount(bad), InputError) << bad;
  }
}

TEST(Level, ReachesTheTargetExactlyAndKeepsAllWhereThereAreFewer) {
  const Survey s = WavySheet(30000);
  const PreparedPoints p = PreparePoints(s, false);
  for (const std::uint64_t target :
       {1ull, 2ull, 7ull, 100ull, 1000ull, 6300ull, 15000ull, 29000ull}) {
    const Level level = Build(p, s, target);
    EXPECT_EQ(level.cloud.size(), target);
    EXPECT_EQ(level.stats.count, target);
    EXPECT_EQ(level.normal.size(), target);
    EXPECT_EQ(level.photo_begin.size(), target + 1);
    EXPECT_EQ(level.photo_begin.back(), level.photo_idx.size());
    level.cloud.Validate("level");
    EXPECT_EQ(level.name, FormatCount(target));
  }
  const Level all = Build(p, s, 50000);
  EXPECT_EQ(all.cloud.size(), 30000u);
  EXPECT_EQ(all.stats.target_count, 50000u);
  EXPECT_THROW(Build(p, s, 0), InputError);
  EXPECT_THROW(PreparePoints(Survey{}, true), InputError);
}

TEST(Level, PointsThatCoincide) {
  Survey s;
  for (int i = 0; i < 5000; ++i) s.points.position.push_back({1.0 + i % 10, 2, 3});
  const PreparedPoints p = PreparePoints(s, true);
  EXPECT_EQ(Build(p, s, 10).cloud.size(), 10u);
  EXPECT_EQ(Build(p, s, 3).cloud.size(), 3u);
  EXPECT_EQ(Build(p, s, 77).cloud.size(), 77u) << "more than there are places: some coincide";
  for (Vec3d& q : s.points.position) q = {1e6, 2, 3};
  const PreparedPoints same = PreparePoints(s, true);
  const Level level = Build(same, s, 5);
  EXPECT_EQ(level.cloud.size(), 5u);
  level.cloud.Validate("level");
  Survey one;
  one.points.position.push_back({1e6, -3, 5});
  EXPECT_EQ(Build(PreparePoints(one, true), one, 63000).cloud.size(), 1u);
}

// A far stray stretches the box a million times over: the grid must not run out of digits.
TEST(Level, AFarStrayDoesNotCostTheRestItsDetail) {
  Survey s = WavySheet(20000);
  s.points.photo_begin.clear();
  s.points.photo_idx.clear();
  s.points.position[7] = {1e9, -1e9, 1e9};
  s.points.position[8] = {NAN, 0, 0};
  const PreparedPoints p = PreparePoints(s, false);
  EXPECT_EQ(p.outliers, 1u);
  const Level level = Build(p, s, 2000);
  EXPECT_EQ(level.cloud.size(), 2000u);
  EXPECT_NEAR(level.stats.spacing, std::sqrt(2.0 / 2000), 0.02 * std::sqrt(2.0 / 2000));
  EXPECT_LT(level.stats.radius_max, 2 * level.stats.radius_median) << "the stray must stay small";
  EXPECT_EQ(PreparePoints(s, true).outliers, 2u);
}

// The mean of a cell's points is off the sheet by its sagitta over the cell.
TEST(Level, EveryMetaballStandsForAPlaceOfTheSheet) {
  const Survey s = WavySheet(30000, 0);
  const Level level = Build(PreparePoints(s, false), s, 3000);
  double most = 0, sum = 0, beside = 0;
  for (std::size_t i = 0; i < level.cloud.size(); ++i) {
    const Vec3d p = level.cloud.frame.WorldFromLocal(level.cloud.center[i]) +
                    level.normal[i].cast<double>() * double(level.depth[i]);
    const double off = p.z - (4 + 0.05 * std::sin(6 * p.x) * std::cos(5 * p.y));
    most = std::max(most, std::abs(off));
    sum += off * off;
    beside = std::max({beside, -p.x, p.x - 2, -p.y, p.y - 1});
  }
  const double spacing = level.stats.spacing;
  EXPECT_LT(std::sqrt(sum / 3000), spacing / 400);
  EXPECT_LT(most, spacing / 40) << "at the rim, where they are moved outwards";
  EXPECT_LT(beside, spacing / 2);
}

TEST(Level, AveragesColourInLinearLight) {
  Survey s;
  for (int i = 0; i < 2; ++i) {
    s.points.position.push_back({i * 0.001, 0, 0});
    s.points.color.push_back(i == 0 ? Rgb8{255, 0, 10} : Rgb8{0, 0, 10});
  }
  s.points.position.push_back({5, 0, 0});
  s.points.color.push_back({1, 2, 3});
  const PreparedPoints p = PreparePoints(s, false);
  const Level level = Build(p, s, 2);
  ASSERT_EQ(level.cloud.size(), 2u);
  const std::size_t pair = level.cloud.color[0].r == 1 ? 1 : 0;
  EXPECT_EQ(level.cloud.color[pair], (Rgb8{188, 0, 10}));
}

TEST(Level, RanksThePhotographsOfEachMetaball) {
  const Survey s = WavySheet(20000, 0.0, 0.0);
  const PreparedPoints p = PreparePoints(s, true);
  const Level level = Build(p, s, 2000);
  for (std::size_t i = 0; i < level.cloud.size(); ++i) {
    const double x = level.cloud.frame.WorldFromLocal(level.cloud.center[i]).x;
    std::set<int> photos(level.photo_idx.begin() + level.photo_begin[i],
                         level.photo_idx.begin() + level.photo_begin[i + 1]);
    if (x < 0.95) {
      EXPECT_EQ(photos, (std::set<int>{0, 1})) << x;
    }
    if (x > 1.05) {
      EXPECT_EQ(photos, (std::set<int>{1, 2})) << x;
    }
    // The camera right above comes first.
    if (x < 0.6) {
      EXPECT_EQ(level.photo_idx[level.photo_begin[i]], 0) << x;
    }
    if (x > 0.96 && x < 0.99) {
      EXPECT_EQ(level.photo_idx[level.photo_begin[i]], 1) << x;
    }
  }
  LevelOptions options;
  options.target_count = 2000;
  options.max_photos_per_metaball = 1;
  EXPECT_EQ(BuildLevel(p, s, options).photo_idx.size(), 2000u);
}

TEST(Prepare, NormalsLookAtThePhotographs) {
  const Survey s = WavySheet(20000);
  const PreparedPoints p = PreparePoints(s, false);
  double sum = 0;
  for (std::size_t i = 0; i < p.points.size(); ++i) {
    const Vec3d& q = p.points.position[i];
    // z = 4 + 0.05 sin(6x) cos(5y), towards -z.
    const Vec3d truth = Normalized(Vec3d{0.3 * std::cos(6 * q.x) * std::cos(5 * q.y),
                                         -0.25 * std::sin(6 * q.x) * std::sin(5 * q.y), -1});
    const double cosine = Dot(p.points.normal[i].cast<double>(), truth);
    EXPECT_GT(cosine, 0.998);
    sum += cosine;
  }
  EXPECT_GT(sum / static_cast<double>(p.points.size()), 0.9998);
}

TEST(Prepare, GivenNormalsStayAndUselessOnesAreReplaced) {
  Survey s = WavySheet(2000);
  s.points.normal.assign(2000, Vec3f{0, 3, 4});
  for (int i = 0; i < 100; ++i) s.points.normal[i] = i % 2 ? Vec3f{} : Vec3f{NAN, 0, 0};
  const PreparedPoints p = PreparePoints(s, false);
  int given = 0;
  for (const Vec3f& n : p.points.normal) {
    EXPECT_NEAR(Length(n), 1, 1e-5);
    given += std::abs(n.y - 0.6f) < 1e-6f;
  }
  EXPECT_EQ(given, 1900);
}

TEST(Prepare, SpacingIsTheRootOfTheAreaOfAPoint) {
  const Survey s = WavySheet(40000, 0);
  PreparedPoints p = PreparePoints(s, false);
  std::nth_element(p.spacing.begin(), p.spacing.begin() + 20000, p.spacing.end());
  EXPECT_NEAR(p.spacing[20000], std::sqrt(2.0 / 40000), 0.05 * std::sqrt(2.0 / 40000));
}

TEST(Prepare, StraysGoTheSurfaceStays) {
  Survey s = WavySheet(40000);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform;
  const auto add = [&](const Vec3d& p) {
    s.points.position.push_back(p);
    s.points.color.push_back({});
    s.points.photo_idx.push_back(1);
    s.points.photo_begin.push_back(s.points.photo_idx.size());
  };
  for (int i = 0; i < 200; ++i) {
    add({2 * uniform(random), uniform(random), 2 + 3.5 * uniform(random)});
  }
  // Clumps as wrong depths make them: as dense as the surface, but small.
  for (int k = 0; k < 10; ++k) {
    const Vec3d c{0.2 * k, 0.5, 3.5 + 0.02 * k};
    for (int i = 0; i < 15; ++i) {
      add(c + Vec3d{0.01 * uniform(random), 0.01 * uniform(random), 0.005 * uniform(random)});
    }
  }
  const PreparedPoints p = PreparePoints(s, true);
  EXPECT_EQ(p.source_points, 40350u);
  int strays = 0, surface = 0;
  for (std::size_t i = 0; i < p.points.size(); ++i) {
    if (p.points.color[i].b == 100) {
      ++surface;
    } else {
      // One that happens to lie near the surface may stay.
      const Vec3d& q = p.points.position[i];
      strays += std::abs(q.z - (4 + 0.05 * std::sin(6 * q.x) * std::cos(5 * q.y))) > 0.05;
    }
  }
  EXPECT_EQ(strays, 0);
  EXPECT_EQ(surface, 40000);
}

TEST(Prepare, ACoarseHalfIsNotTakenForStrays) {
  Survey s = WavySheet(20000);
  // Beside the sheet, at an eighth of the density.
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform;
  for (int i = 0; i < 50; ++i) {
    for (int j = 0; j < 25; ++j) {
      s.points.position.push_back({2 + (i + uniform(random)) / 25, (j + uniform(random)) / 25, 4});
      s.points.color.push_back({});
      s.points.photo_begin.push_back(s.points.photo_idx.size());
    }
  }
  const PreparedPoints p = PreparePoints(s, true);
  const auto fine = std::count_if(p.points.position.begin(), p.points.position.end(),
                                  [](const Vec3d& q) { return q.x < 2; });
  EXPECT_EQ(fine, 20000);
  // All but the first column and some of the second, which lie beside points many times as dense.
  const auto beyond = std::count_if(p.points.position.begin(), p.points.position.end(),
                                    [](const Vec3d& q) { return q.x > 2.08; });
  EXPECT_EQ(beyond, 1200) << "of 1200";
  EXPECT_GE(p.points.size(), 21220u) << "of 21250";
}

TEST(Prepare, PointsThePhotographsSeeThroughGo) {
  Survey s = WavySheet(20000);
  for (int i = 3; i < 8; ++i) {
    Photograph photo;
    photo.cam_from_world = test::PoseAt({0.2 * i, 0.3, 0});
    s.photographs.push_back(photo);
  }
  SurveyPoints& points = s.points;
  points.photo_begin = {0};
  points.photo_idx.clear();
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::uint32_t k = 0; k < 8; ++k) points.photo_idx.push_back(k);
    points.photo_begin.push_back(points.photo_idx.size());
  }
  // A dense patch that floats before the sheet, large enough to be no clump, listed for one.
  for (int i = 0; i < 400; ++i) {
    points.position.push_back({0.9 + 0.01 * (i % 20), 0.4 + 0.01 * (i / 20), 3.0});
    points.color.push_back({});
    points.photo_idx.push_back(4);
    points.photo_begin.push_back(points.photo_idx.size());
  }
  const PreparedPoints p = PreparePoints(s, true);
  const auto floating = std::count_if(p.points.position.begin(), p.points.position.end(),
                                      [](const Vec3d& q) { return q.z < 3.5; });
  EXPECT_EQ(floating, 0);
  EXPECT_EQ(p.points.size(), 20000u);
}

TEST(Prepare, TheOrderOfTheInputDoesNotMatter) {
  const Survey s = WavySheet(5000);
  Survey reversed = s;
  std::reverse(reversed.points.position.begin(), reversed.points.position.end());
  std::reverse(reversed.points.color.begin(), reversed.points.color.end());
  reversed.points.photo_begin.clear();
  reversed.points.photo_idx.clear();
  Survey plain = s;
  plain.points.photo_begin.clear();
  plain.points.photo_idx.clear();
  const Level a = Build(PreparePoints(plain, true), plain, 700);
  const Level b = Build(PreparePoints(reversed, true), reversed, 700);
  EXPECT_EQ(a.cloud.center, b.cloud.center);
  EXPECT_EQ(a.cloud.radius, b.cloud.radius);
}

void ExpectSame(const Level& a, const Level& b) {
  EXPECT_EQ(a.cloud.center, b.cloud.center);
  EXPECT_EQ(a.cloud.radius, b.cloud.radius);
  EXPECT_EQ(a.cloud.color, b.cloud.color);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.photo_begin, b.photo_begin);
  EXPECT_EQ(a.photo_idx, b.photo_idx);
}

TEST(Level, TheSameForAnyNumberOfThreads) {
  const Survey s = WavySheet(30000);
  std::optional<Level> first;
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Level level = Build(PreparePoints(s, true), s, 4000);
    if (first) {
      ExpectSame(*first, level);
    } else {
      first = level;
    }
  }
}

// In UTM coordinates the level is the same to a rounding of the input.
TEST(Level, FarFromTheOriginTheSame) {
  const Survey s = WavySheet(10000);
  Survey utm = s;
  const Vec3d shift{500000, 4649000, 128};  // exact in binary
  for (Vec3d& p : utm.points.position) p = p + shift;
  for (Photograph& photo : utm.photographs) {
    photo.cam_from_world.translation =
        photo.cam_from_world.translation - photo.cam_from_world.Rotate(shift);
  }
  const Level a = Build(PreparePoints(s, true), s, 1000);
  const Level b = Build(PreparePoints(utm, true), utm, 1000);
  ASSERT_EQ(a.cloud.size(), b.cloud.size());
  EXPECT_NEAR(a.stats.spacing, b.stats.spacing, 1e-6 * a.stats.spacing);
  EXPECT_NEAR(a.stats.radius_median, b.stats.radius_median, 1e-6 * a.stats.radius_median);
  // To the floats of the local frame.
  for (std::size_t i = 0; i < a.cloud.size(); ++i) {
    const Vec3d here = a.cloud.frame.WorldFromLocal(a.cloud.center[i]);
    const Vec3d there = b.cloud.frame.WorldFromLocal(b.cloud.center[i]) - shift;
    EXPECT_LT(Length(here - there), 4e-7) << i;
    EXPECT_NEAR(a.cloud.RadiusOf(i) * a.cloud.frame.unit, b.cloud.RadiusOf(i) * b.cloud.frame.unit,
                4e-7)
        << i;
  }
}

TEST(Level, OpenShareSaysWhereThePointsAreTooFew) {
  Survey s = WavySheet(20000);
  s.points.photo_begin.clear();
  s.points.photo_idx.clear();
  EXPECT_LT(Build(PreparePoints(s, false), s, 5000).stats.open_share, 0.001);
  // A tenth of a coarse surface beside it.
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 10; ++j) {
      s.points.position.push_back({3 + 0.3 * i, 0.3 * j, 4});
      s.points.color.push_back({});
    }
  }
  const double open = Build(PreparePoints(s, false), s, 5000).stats.open_share;
  EXPECT_NEAR(open, 100.0 / 5000, 2.0 / 5000);
}

TEST(Level, RadiiForCloudsWithout) {
  std::vector<Vec3d> grid;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) grid.push_back({0.1 * i, 0.1 * j, 0});
  }
  grid.push_back({NAN, 0, 0});
  std::vector<double> spacing;
  const std::vector<double> radii = RadiiFromSpacing(grid, 2.0, &spacing);
  ASSERT_EQ(radii.size(), grid.size());
  ASSERT_EQ(spacing.size(), grid.size());
  // d8 of a grid is the diagonal: 0.1 sqrt 2 sqrt(pi / 8).
  EXPECT_NEAR(spacing[820], 0.1 * std::sqrt(M_PI / 4), 1e-7);
  EXPECT_NEAR(radii[820], 2 * spacing[820], 1e-9);
  EXPECT_GT(radii.back(), 0);
  EXPECT_TRUE(RadiiFromSpacing({}).empty());
  EXPECT_EQ(RadiiFromSpacing({{1, 2, 3}}).size(), 1u);
  EXPECT_THROW(RadiiFromSpacing(grid, INFINITY), Error);
}

TEST(Level, CanBeCancelledAnywhere) {
  const Survey s = WavySheet(20000);
  const PreparedPoints p = PreparePoints(s, true);
  for (int calls = 0; calls < 6; ++calls) {
    std::stop_source source;
    int left = calls;
    Control control;
    control.stop = source.get_token();
    control.progress = [&](std::string_view, double fraction) {
      EXPECT_GE(fraction, 0);
      EXPECT_LE(fraction, 1);
      if (left-- <= 0) source.request_stop();
    };
    EXPECT_THROW(PreparePoints(s, true, control), Cancelled) << calls;
    left = calls;
    source = {};
    control.stop = source.get_token();
    LevelOptions options;
    options.target_count = 5000;
    EXPECT_THROW(BuildLevel(p, s, options, control), Cancelled) << calls;
  }
}

TEST(Downsample, EveryPointIsInOneCell) {
  const Survey s = WavySheet(9000);
  for (const std::uint64_t target : {1ull, 37ull, 900ull, 8999ull, 9000ull, 20000ull}) {
    const PointCells cells = GroupPoints(s.points.position, target);
    ASSERT_EQ(cells.size(), std::min<std::uint64_t>(target, 9000));
    std::vector<int> seen(9000, 0);
    for (std::size_t c = 0; c < cells.size(); ++c) {
      EXPECT_LT(cells.cell_begin[c], cells.cell_begin[c + 1]) << "no cell is empty";
    }
    for (const std::uint32_t i : cells.point_idx) ++seen[i];
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 9000);
  }
}

// A lattice is the worst for a voxel grid: the count jumps as the voxel grows past the step.
TEST(Downsample, ALattice) {
  std::vector<Vec3d> lattice;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      for (int k = 0; k < 20; ++k) lattice.push_back({double(i), double(j), double(k)});
    }
  }
  for (const std::uint64_t target : {999ull, 1001ull, 3000ull, 7999ull}) {
    EXPECT_EQ(GroupPoints(lattice, target).size(), target);
  }
}

}  // namespace
}  // namespace sherd
