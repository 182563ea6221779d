// Points reduced to a target count in each of the ways there are.
#include "reconstruction/reduction.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <optional>
#include <random>
#include <set>

#include "metaball/error.h"
#include "reconstruction/sample_elimination.h"

namespace sherd {
namespace {

constexpr Reduction kAll[] = {Reduction::kVoxel, Reduction::kBlueNoise, Reduction::kAdaptive};

// Strewn at random over [0, 2] x [0, 1]; flat for x < 1, in waves beyond.
Survey HalfInWaves(int n) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform;
  Survey s;
  for (int i = 0; i < n; ++i) {
    const double x = 2 * uniform(random), y = uniform(random);
    const double phase = 40 * std::max(0.0, x - 1);
    s.points.position.push_back({x, y, 0.02 * (1 - std::cos(phase))});
    const double slope = x > 1 ? 0.8 * std::sin(phase) : 0.0;
    s.points.normal.push_back(Normalized(Vec3d{-slope, 0, 1}).cast<float>());
  }
  return s;
}

LevelOptions OptionsFor(Reduction reduction, std::uint64_t target, bool nested = false) {
  LevelOptions options;
  options.target_count = target;
  options.reduction = reduction;
  options.nested = nested;
  return options;
}

std::vector<Vec3d> MeansOf(const SurveyPoints& points, const PointCells& cells) {
  std::vector<Vec3d> out;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    Vec3d sum{};
    for (std::uint32_t j = cells.cell_begin[c]; j < cells.cell_begin[c + 1]; ++j) {
      sum += points.position[cells.point_idx[j]];
    }
    out.push_back(sum / double(cells.cell_begin[c + 1] - cells.cell_begin[c]));
  }
  return out;
}

// Mean and standard deviation of the distance to the nearest other.
std::pair<double, double> NearestDistance(const std::vector<Vec3d>& p) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    double nearest = INFINITY;
    for (std::size_t j = 0; j < p.size(); ++j) {
      if (j != i) nearest = std::min(nearest, Length(p[i] - p[j]));
    }
    sum += nearest;
    squares += nearest * nearest;
  }
  const double n = static_cast<double>(p.size()), mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean))};
}

TEST(Reduction, Names) {
  for (const Reduction kind : kAll) EXPECT_EQ(FindReduction(ReductionName(kind)), kind);
  EXPECT_EQ(FindReduction("octree"), std::nullopt);
  EXPECT_EQ(ReductionNames().size(), 3u);
}

TEST(Reduction, EveryPointIsInOneCellAndTheCountIsExact) {
  const Survey s = HalfInWaves(6000);
  PreparedPoints p = PreparePoints(s, false);
  for (const Reduction kind : kAll) {
    for (const bool nested : {false, true}) {
      if (nested && kind == Reduction::kVoxel) continue;
      if (nested) OrderPoints(kind, &p);
      for (const std::uint64_t target : {1ull, 37ull, 700ull, 5999ull, 6000ull, 9000ull}) {
        const PointCells cells = ReducePoints(p, OptionsFor(kind, target, nested));
        ASSERT_EQ(cells.size(), std::min<std::uint64_t>(target, 6000)) << ReductionName(kind);
        std::vector<int> seen(6000, 0);
        for (std::size_t c = 0; c < cells.size(); ++c) {
          EXPECT_LT(cells.cell_begin[c], cells.cell_begin[c + 1]) << "no cell is empty";
        }
        for (const std::uint32_t i : cells.point_idx) ++seen[i];
        EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 6000);
      }
    }
  }
}

TEST(Reduction, BlueNoiseIsMoreEvenThanVoxels) {
  const Survey s = HalfInWaves(20000);
  const PreparedPoints p = PreparePoints(s, false);
  const auto spread = [&](Reduction kind) {
    const auto [mean, deviation] =
        NearestDistance(MeansOf(p.points, ReducePoints(p, OptionsFor(kind, 1500))));
    return deviation / mean;
  };
  EXPECT_LT(spread(Reduction::kBlueNoise), 0.6 * spread(Reduction::kVoxel));
}

TEST(Reduction, AdaptiveGoesWhereTheSurfaceBends) {
  const Survey s = HalfInWaves(20000);
  const PreparedPoints p = PreparePoints(s, false);
  const auto share_in_waves = [&](Reduction kind) {
    const std::vector<Vec3d> means = MeansOf(p.points, ReducePoints(p, OptionsFor(kind, 1500)));
    return static_cast<double>(
               std::count_if(means.begin(), means.end(), [](const Vec3d& q) { return q.x > 1; })) /
           static_cast<double>(means.size());
  };
  EXPECT_NEAR(share_in_waves(Reduction::kBlueNoise), 0.53, 0.04) << "by area";
  EXPECT_GT(share_in_waves(Reduction::kAdaptive), 0.75);
}

TEST(Reduction, NestedLevelsHoldThePointsOfTheCoarserOnes) {
  const Survey s = HalfInWaves(8000);
  PreparedPoints p = PreparePoints(s, false);
  for (const Reduction kind : {Reduction::kBlueNoise, Reduction::kAdaptive}) {
    OrderPoints(kind, &p);
    std::set<std::uint32_t> finer;
    for (const std::uint64_t target : {4000ull, 1800ull, 500ull}) {
      const PointCells cells = ReducePoints(p, OptionsFor(kind, target, true));
      ASSERT_EQ(cells.seed.size(), target);
      const std::set<std::uint32_t> seeds(cells.seed.begin(), cells.seed.end());
      if (!finer.empty()) {
        EXPECT_TRUE(std::includes(finer.begin(), finer.end(), seeds.begin(), seeds.end()));
      }
      finer = seeds;
      // And the metaballs stand for just these points.
      const Level level = BuildLevel(p, s, OptionsFor(kind, target, true));
      ASSERT_EQ(level.depth.size(), target);
      for (std::size_t i = 0; i < level.cloud.size(); i += 50) {
        const Vec3d point = level.cloud.frame.WorldFromLocal(level.cloud.center[i]) +
                            level.normal[i].cast<double>() * double(level.depth[i]);
        double nearest = INFINITY;
        for (const std::uint32_t k : cells.seed) {
          nearest = std::min(nearest, Length(p.points.position[k] - point));
        }
        EXPECT_LT(nearest, 1e-6);
      }
    }
    // Evenly spaced all the same: prefixes of one order are no random choice.
    std::vector<Vec3d> kept;
    for (std::size_t i = 0; i < 700; ++i) kept.push_back(p.points.position[p.order[i]]);
    if (kind == Reduction::kBlueNoise) {
      const auto [mean, deviation] = NearestDistance(kept);
      EXPECT_LT(deviation, 0.25 * mean) << "0.52 for points strewn at random";
    }
  }
}

TEST(Reduction, NestedNeedsAnOrder) {
  const Survey s = HalfInWaves(500);
  PreparedPoints p = PreparePoints(s, false);
  EXPECT_THROW(ReducePoints(p, OptionsFor(Reduction::kBlueNoise, 100, true)), InputError);
  EXPECT_THROW(OrderPoints(Reduction::kVoxel, &p), InputError);
  OrderPoints(Reduction::kBlueNoise, &p);
  EXPECT_THROW(ReducePoints(p, OptionsFor(Reduction::kAdaptive, 100, true)), InputError);
}

TEST(Reduction, TheSameForAnyNumberOfThreads) {
  const Survey s = HalfInWaves(12000);
  for (const Reduction kind : kAll) {
    std::optional<Level> first;
    for (const int threads : {1, 2, 5}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      PreparedPoints p = PreparePoints(s, true);
      const bool nested = kind == Reduction::kAdaptive;
      if (nested) OrderPoints(kind, &p);
      Level level = BuildLevel(p, s, OptionsFor(kind, 2000, nested));
      if (first) {
        EXPECT_EQ(first->cloud.center, level.cloud.center);
        EXPECT_EQ(first->cloud.radius, level.cloud.radius);
        EXPECT_EQ(first->depth, level.depth);
        EXPECT_EQ(first->stats.error_mean, level.stats.error_mean);
        EXPECT_EQ(first->stats.error_max, level.stats.error_max);
      } else {
        first = std::move(level);
      }
    }
  }
}

TEST(Reduction, PointsThatCoincide) {
  Survey s;
  for (int i = 0; i < 3000; ++i) s.points.position.push_back({1.0 + i % 10, 2, 3});
  PreparedPoints p = PreparePoints(s, true);
  for (const Reduction kind : {Reduction::kBlueNoise, Reduction::kAdaptive}) {
    OrderPoints(kind, &p);
    for (const std::uint64_t target : {3ull, 10ull, 77ull}) {
      for (const bool nested : {false, true}) {
        const Level level = BuildLevel(p, s, OptionsFor(kind, target, nested));
        EXPECT_EQ(level.cloud.size(), target);
        level.cloud.Validate("level");
      }
    }
  }
}

TEST(SampleElimination, TheMostCrowdedGoFirst) {
  Samples line;
  for (const double x : {0.0, 1.0, 1.1, 2.1, 3.1}) {
    line.position.push_back({x, 0, 0});
    line.area.push_back(1.0);
  }
  const std::vector<std::uint32_t> kept = EliminateSamples(line, 4);
  EXPECT_EQ(kept.size(), 4u);
  EXPECT_TRUE(std::find(kept.begin(), kept.end(), 1u) == kept.end() ||
              std::find(kept.begin(), kept.end(), 2u) == kept.end());
  EXPECT_EQ(EliminateSamples(line, 5).size(), 5u);
  std::vector<std::uint32_t> order = EliminationOrder(line);
  std::sort(order.begin(), order.end());
  EXPECT_EQ(order, (std::vector<std::uint32_t>{0, 1, 2, 3, 4}));
  EXPECT_TRUE(EliminationOrder({}).empty());
}

}  // namespace
}  // namespace sherd
