// Each kernel's body on its own, against the plainest possible way of saying the same thing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "cuda/kernels/binning.h"
#include "cuda/kernels/device_ops.h"
#include "cuda/kernels/resolve.h"
#include "cuda/kernels/trace.h"
#include "metaball/local_view.h"

namespace sherd::kernels {
namespace {

TEST(OrderedBits, KeepTheOrderOfFloatsAndComeBack) {
  const std::vector<float> values{-INFINITY, -1e30f, -2.0f, -1.0f, -1e-40f, -0.0f,
                                  0.0f,      1e-40f, 1.0f,  2.0f,  1e30f,   INFINITY};
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(BitsOf(FloatFromOrdered(OrderedBits(values[i]))), BitsOf(values[i]));
    if (i > 0) {
      EXPECT_LT(OrderedBits(values[i - 1]), OrderedBits(values[i])) << values[i];
    }
    // No distance is taken for a metaball out of view.
    EXPECT_NE(OrderedBits(values[i]), kOutOfView);
  }
}

TEST(TileCount, CountsEveryTileTheBoxTouches) {
  EXPECT_EQ(TileCount({0, 0, 0, 0}), 0u);
  EXPECT_EQ(TileCount({0, 0, 1, 1}), 1u);
  EXPECT_EQ(TileCount({7, 7, 9, 9}), 4u);
  EXPECT_EQ(TileCount({8, 0, 16, 8}), 1u);
  EXPECT_EQ(TileCount({0, 0, 65528, 65528}), 8191u * 8191u);
}

TEST(CoverageOf, HasTheBitOfEveryCoveredPixelAndNoOther) {
  using Program =
      TraceProgram<TraceTraits<ThresholdMode::kUniform, false, false, float, MurakamiShape>>;
  std::mt19937 random(1);
  for (int round = 0; round < 3000; ++round) {
    const int tx = 8 * static_cast<int>(random() % 5), ty = 8 * static_cast<int>(random() % 5);
    // Any box that touches the tile.
    const auto edge = [&](int tile, int* lo, int* hi) {
      *lo = std::max(0, tile + 7 - static_cast<int>(random() % 24));
      *hi = std::max({*lo + 1, tile + 1}) + static_cast<int>(random() % 24);
    };
    int x0, x1, y0, y1;
    edge(tx, &x0, &x1);
    edge(ty, &y0, &y1);
    const PixelBox16 box{static_cast<std::uint16_t>(x0), static_cast<std::uint16_t>(y0),
                         static_cast<std::uint16_t>(x1), static_cast<std::uint16_t>(y1)};
    const std::uint64_t bits = Program::CoverageOf(box, tx, ty);
    for (int t = 0; t < kTileRays; ++t) {
      const int x = tx + t % kTileSize, y = ty + t / kTileSize;
      const bool inside = x >= x0 && x < x1 && y >= y0 && y < y1;
      ASSERT_EQ(bits >> t & 1, inside ? 1u : 0u) << x0 << ' ' << x1 << ' ' << tx << ' ' << t;
    }
  }
}

// A random frame's boxes, binned by the kernels and by loops.
TEST(Binning, EveryTileGetsItsMetaballsNearestFirst) {
  std::mt19937 random(2);
  for (const std::uint32_t n : {1u, 2u, 17u, 500u}) {
    const int width = 200, height = 90, tiles_x = 25, tiles_y = 12;
    std::vector<PixelBox16> box(n);
    std::vector<std::uint32_t> front(n), order(n), key(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      const int x = static_cast<int>(random() % width), y = static_cast<int>(random() % height);
      // A few cover the whole picture, some are out of view.
      const bool huge = random() % 20 == 0, none = n > 1 && random() % 5 == 0;
      const int w = 1 + static_cast<int>(random() % 30), h = 1 + static_cast<int>(random() % 30);
      box[i] = huge ? PixelBox16{0, 0, width, height}
                    : PixelBox16{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                                 static_cast<std::uint16_t>(std::min(width, x + w)),
                                 static_cast<std::uint16_t>(std::min(height, y + h))};
      if (none) box[i] = {0, 0, 0, 0};
      // Equal distances happen: then the cloud's order decides.
      front[i] = none ? kOutOfView : OrderedBits(static_cast<float>(random() % 50) - 10.0f);
      order[i] = i;
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return front[a] < front[b]; });
    for (std::uint32_t i = 0; i < n; ++i) key[i] = front[order[i]];

    BinTotals totals;
    std::vector<std::uint32_t> tiles(n + 1, 77);
    const CountTiles count{n, key.data(), order.data(), box.data(), tiles.data(), &totals};
    for (std::uint32_t i = 0; i <= n; ++i) count(i);
    std::vector<std::uint64_t> offset(n + 1);
    std::uint64_t sum = 0;
    for (std::uint32_t i = 0; i <= n; ++i) {
      offset[i] = sum;
      sum += tiles[i];
    }
    TakeTotal{n, offset.data(), &totals}(0);
    EXPECT_EQ(totals.entries, sum);
    EXPECT_EQ(totals.in_view,
              n - static_cast<std::uint32_t>(std::count(front.begin(), front.end(), kOutOfView)));

    std::vector<std::uint32_t> tile(sum, ~0u), metaball(sum, ~0u);
    const FillEntries fill{sum,          totals.in_view, tiles_x,     offset.data(),
                           order.data(), box.data(),     tile.data(), metaball.data()};
    for (std::uint64_t t = 0; t < FillEntries::Threads(sum); ++t) fill(t);
    std::vector<std::uint32_t> by_tile(sum);
    for (std::uint32_t e = 0; e < sum; ++e) by_tile[e] = e;
    std::stable_sort(by_tile.begin(), by_tile.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return tile[a] < tile[b]; });
    std::vector<std::uint32_t> sorted_tile(sum), sorted_metaball(sum);
    for (std::uint32_t e = 0; e < sum; ++e) {
      sorted_tile[e] = tile[by_tile[e]];
      sorted_metaball[e] = metaball[by_tile[e]];
    }
    std::vector<EntryRange> range(tiles_x * tiles_y, EntryRange{0, 0});
    const FindRanges find{sum, sorted_tile.data(), range.data()};
    for (std::uint64_t e = 0; e < sum; ++e) find(e);

    for (int t = 0; t < tiles_x * tiles_y; ++t) {
      const int tx = t % tiles_x * kTileSize, ty = t / tiles_x * kTileSize;
      std::vector<std::uint32_t> expected;
      for (const std::uint32_t i : order) {
        const PixelBox16 b = box[i];
        if (b.x0 < tx + kTileSize && b.x1 > tx && b.y0 < ty + kTileSize && b.y1 > ty) {
          expected.push_back(i);
        }
      }
      const std::vector<std::uint32_t> actual(sorted_metaball.begin() + range[t].begin,
                                              sorted_metaball.begin() + range[t].end);
      ASSERT_EQ(actual, expected) << "tile " << t << " of " << n << " metaballs";
    }
  }
}

TEST(MeasureBounds, BoxesHoldEveryRayThatMeetsTheMetaballAndFrontsAreLowerBounds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  constexpr int n = 200;
  std::vector<Sphere> sphere(n);
  for (int i = 0; i < n; ++i) {
    sphere[i] = {uniform(random), uniform(random), uniform(random), 0};
    sphere[i].radius = 0.02f * std::exp(2 * uniform(random));
  }
  for (const bool orthographic : {false, true}) {
    const Camera camera =
        orthographic
            ? Camera::LookAtOrthographic({0, 0, -1}, {0.1, 0, 0}, {0, 1, 0}, 2, 64, 48)
            : Camera::LookAt({0, 0.2, -0.9}, {0.1, 0, 0}, {0, 1, 0}, 1.7, 64, 48);  // some inside
    const MetaballArrays metaballs{sphere.data(), 1.5, n};
    std::vector<PixelBox16> box(n);
    std::vector<std::uint32_t> front(n), key(n), item(n);
    const MeasureBounds body{metaballs,    ViewOf(camera), box.data(),
                             front.data(), key.data(),     item.data()};
    for (int i = 0; i < n; ++i) body(static_cast<std::uint64_t>(i));
    int met = 0;
    for (int i = 0; i < n; ++i) {
      EXPECT_EQ(item[i], static_cast<std::uint32_t>(i));
      EXPECT_EQ(key[i], front[i]);
      EXPECT_EQ(front[i] == kOutOfView, box[i].x0 >= box[i].x1);
      for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
          const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
          const Vec3d v = sphere[i].center().cast<double>() - ray.origin;
          const double r = sphere[i].radius * 1.5, b = Dot(v, ray.direction);
          const double h = r * r - (Dot(v, v) - b * b);
          if (!(h > 0) || b + std::sqrt(h) <= 0) continue;
          ++met;
          ASSERT_TRUE(x >= box[i].x0 && x < box[i].x1 && y >= box[i].y0 && y < box[i].y1);
          ASSERT_LE(FloatFromOrdered(front[i]), b - std::sqrt(h) + 1e-12);
        }
      }
    }
    EXPECT_GT(met, 1000);
  }
}

TEST(Resolve, AveragesColourAndTakesTheMiddleSampleOfThePlanes) {
  constexpr int kWidth = 3, kHeight = 2, kSamples = 3, kComponents = 2;
  std::vector<Pixel> fine(kWidth * kHeight * kSamples * kSamples);
  std::vector<float> fine_plane;
  for (std::size_t i = 0; i < fine.size(); ++i) {
    fine[i] = {static_cast<float>(i), 1.0f, 0.0f, i % 2 ? 1.0f : 0.0f};
    for (int c = 0; c < kComponents; ++c) fine_plane.push_back(static_cast<float>(i) + 0.5f * c);
  }
  std::vector<Pixel> color(kWidth * kHeight);
  std::vector<float> plane(color.size() * kComponents);
  const ResolveColor resolve{kWidth, kSamples, fine.data(), color.data()};
  for (std::size_t i = 0; i < color.size(); ++i) resolve(i);
  const TakeMiddle<float> take{kWidth, kSamples, kComponents, fine_plane.data(), plane.data()};
  for (std::size_t i = 0; i < plane.size(); ++i) take(i);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const int middle = (y * kSamples + 1) * kWidth * kSamples + x * kSamples + 1;
      const std::size_t at = static_cast<std::size_t>(y) * kWidth + x;
      EXPECT_FLOAT_EQ(color[at].r, static_cast<float>(middle));  // the mean of a linear ramp
      EXPECT_FLOAT_EQ(color[at].g, 1.0f);
      EXPECT_NEAR(color[at].a, middle % 2 ? 5.0f / 9 : 4.0f / 9, 1e-6);
      EXPECT_EQ(plane[at * kComponents], static_cast<float>(middle));
      EXPECT_EQ(plane[at * kComponents + 1], static_cast<float>(middle) + 0.5f);
    }
  }
}

}  // namespace
}  // namespace sherd::kernels
