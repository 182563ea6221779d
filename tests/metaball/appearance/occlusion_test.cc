// Shadow rays: the packets against the scalar march, both against the reference in double
// precision.
#include "metaball/appearance/occlusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "metaball/appearance/hit_groups.h"
#include "metaball/density/model.h"
#include "metaball/reference/reference.h"
#include "metaball/renderer.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

constexpr double kThreshold = 0.7;
// A metaball of radius 1 alone is a sphere of this radius.
const double kSphere = std::sqrt(1 - std::sqrt(kThreshold));

std::vector<std::uint8_t> CastAll(const Occlusion& occlusion,
                                  const std::vector<OcclusionRay>& rays) {
  Occlusion::Scratch scratch;
  std::vector<std::uint8_t> occluded(rays.size());
  occlusion.Cast(rays.data(), static_cast<int>(rays.size()), &scratch, occluded.data());
  EXPECT_EQ(scratch.counts.unresolved, 0u);
  return occluded;
}

OcclusionRay LocalRay(const Cloud& cloud, const Vec3d& from, const Vec3d& direction, double begin,
                      double end) {
  const double unit = cloud.frame.unit;
  return {cloud.frame.LocalFromWorld(from), direction, begin / unit, end / unit};
}

TEST(FibonacciDirections, CoverTheSphereEvenly) {
  for (const int n : {8, 32, 101}) {
    Vec3d sum{};
    double xx = 0;
    for (int k = 0; k < n; ++k) {
      const Vec3d d = FibonacciDirection(k, n);
      EXPECT_NEAR(Length(d), 1, 1e-12);
      sum += d;
      xx += d.x * d.x;
    }
    EXPECT_LT(Length(sum) / n, 0.1);
    EXPECT_NEAR(xx / n, 1.0 / 3, 0.08);
  }
}

// The way is shut exactly where the surface is.
TEST(Occlusion, SeesAMetaballFromEverySide) {
  const Scene scene = testing::SceneOf(testing::OneMetaball({0, 0, 0}, 1), kThreshold);
  const Cloud& cloud = *scene.cloud;
  const Occlusion occlusion(scene, 1);
  Occlusion::Scratch scratch;
  for (int k = 0; k < 20; ++k) {
    const Vec3d direction = FibonacciDirection(k, 20);
    const Vec3d side = Normalized(Cross(direction, Vec3d{0.3, 0.5, 0.9}));
    std::vector<OcclusionRay> rays;
    std::vector<bool> expected;
    for (int j = 0; j < 50; ++j) {
      const double across = kSphere * (0.5 + j * 0.02 + 0.0101);
      const Vec3d behind = side * across - direction * (1.2 * kSphere);
      rays.push_back(LocalRay(cloud, behind, direction, 1e-6, INFINITY));
      expected.push_back(across < kSphere);
      rays.push_back(LocalRay(cloud, behind + direction * (3 * kSphere), direction, 0, INFINITY));
      expected.push_back(false);
      // A short reach behind the sphere meets nothing, nor does one that ends before it.
      rays.push_back(LocalRay(cloud, behind - direction, direction, 0, 0.5));
      expected.push_back(false);
      // No way at all.
      rays.push_back(LocalRay(cloud, behind, direction, 1, 0.5));
      expected.push_back(false);
    }
    const std::vector<std::uint8_t> occluded = CastAll(occlusion, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      EXPECT_EQ(occluded[i] != 0, expected[i]) << k << " " << i;
      EXPECT_EQ(occlusion.CastOne(rays[i], &scratch), expected[i]) << k << " " << i;
    }
  }
}

// Every density and every way of thresholds.
TEST(Occlusion, AgreesWithTheReferenceForEveryDensityAndThreshold) {
  CloudInput input = testing::RandomBall(40, 0.5, 3, 31);
  for (std::size_t i = 0; i < input.center.size(); ++i) {
    input.threshold.push_back(0.2 + 0.01 * static_cast<double>(i % 10));
  }
  const auto cloud = std::make_shared<Cloud>(BuildCloud(input));
  Occlusion::Scratch scratch;
  for (const DensityModel& model : AllDensities()) {
    for (const ThresholdMode mode : {ThresholdMode::kUniform, ThresholdMode::kBlended,
                                     ThresholdMode::kSummed, ThresholdMode::kGated}) {
      Scene scene;
      scene.cloud = cloud;
      scene.surface.density = model;
      scene.surface.mode = mode;
      scene.surface.threshold = 0.25;
      const Occlusion occlusion(scene, 1);
      int shut = 0, open = 0;
      for (int k = 0; k < 4; ++k) {
        const Vec3d to_light = FibonacciDirection(k, 4);
        std::vector<OcclusionRay> rays;
        std::vector<bool> expected;
        for (int j = 0; j < 40; ++j) {
          const Vec3d point = FibonacciDirection(j, 40) * (0.8 + 0.01 * j);
          constexpr double kAway = 8;
          const ReferenceHit hit = ReferenceTrace(scene, {point + to_light * kAway, -to_light});
          if (hit.grazing || std::abs(hit.depth - kAway) < 1e-3) continue;
          expected.push_back(hit.hit && hit.depth < kAway);
          (expected.back() ? shut : open) += 1;
          rays.push_back({point, to_light, 1e-6, INFINITY});
        }
        const std::vector<std::uint8_t> occluded = CastAll(occlusion, rays);
        for (std::size_t i = 0; i < rays.size(); ++i) {
          EXPECT_EQ(occluded[i] != 0, expected[i])
              << TextOf(model) << " mode " << NameOf(mode) << " " << k << " " << i;
          EXPECT_EQ(occlusion.CastOne(rays[i], &scratch), expected[i])
              << TextOf(model) << " mode " << NameOf(mode) << " " << k << " " << i;
        }
      }
      EXPECT_GE(shut, 5) << TextOf(model);
      EXPECT_GE(open, 5) << TextOf(model);
    }
  }
}

// Groups of rays as the passes cast them: from neighbouring points along one direction, or towards
// one place, and rays that have nothing to do with each other.
std::vector<OcclusionRay> GroupOf(const Cloud& cloud, double radius, int kind,
                                  std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto any = [&] { return Vec3d{uniform(*random), uniform(*random), uniform(*random)}; };
  const Vec3d middle = any(), direction = Normalized(any()), place = any() * 1.5;
  std::vector<OcclusionRay> rays;
  const int count = 1 + static_cast<int>((*random)() % 150);
  for (int i = 0; i < count; ++i) {
    const Vec3d point = kind == 2 ? any() : middle + any() * radius;
    const Vec3d to_place = place - point;
    const Vec3d along = kind == 0 ? direction : Normalized(kind == 1 ? to_place : any());
    const double end = kind == 0   ? (count % 2 ? INFINITY : 0.5)
                       : kind == 1 ? Length(to_place)
                                   : 1 + uniform(*random);
    rays.push_back(LocalRay(cloud, point, along, 0.02 * radius, end));
  }
  return rays;
}

struct PacketScene {
  const char* name;
  int count;
  double radius, spread;  // RandomBall
  const char* density;
  double threshold;
  ThresholdMode mode;
};

// The answers may differ only where the highest value of F on the ray is the threshold but for
// rounding: where a threshold a little higher is not reached and one a little lower is.
TEST(Occlusion, PacketsDecideAsTheScalarMarchDoes) {
  const PacketScene scenes[] = {
      {"one radius", 400, 0.25, 1, "murakami", 0.7, ThresholdMode::kUniform},
      {"sparse", 60, 0.25, 2, "murakami", 0.3, ThresholdMode::kUniform},
      {"crowded", 3000, 0.25, 2, "murakami", 1.5, ThresholdMode::kUniform},
      {"own radii", 400, 0.3, 4, "wyvill", 0.6, ThresholdMode::kUniform},
      {"exponentials", 300, 0.3, 2, "blinn:16,5", 0.4, ThresholdMode::kUniform},
      {"negative lobes", 150, 0.4, 2, "trigonometric:7.85", 0.4, ThresholdMode::kUniform},
      {"wide radii, doubles", 300, 0.5, 1000, "murakami", 0.5, ThresholdMode::kUniform},
      {"stiff, doubles", 300, 0.3, 2, "murakami", 0.9995, ThresholdMode::kUniform},
      {"blended", 300, 0.3, 3, "murakami", 0.5, ThresholdMode::kBlended},
      {"blended, wide radii", 200, 0.5, 500, "murakami", 0.5, ThresholdMode::kBlended},
  };
  for (const PacketScene& s : scenes) {
    CloudInput input = testing::RandomBall(s.count, s.radius, s.spread, 5);
    if (s.mode == ThresholdMode::kBlended) {
      for (int i = 0; i < s.count; ++i)
        input.threshold.push_back(s.threshold * (1 + 0.02 * (i % 9)));
    }
    Scene scene = testing::SceneOf(input, s.threshold);
    scene.surface.density = ParseDensity(s.density);
    scene.surface.mode = s.mode;
    const auto with_threshold = [&](double factor) {
      Scene changed = scene;
      changed.surface.threshold *= factor;
      auto cloud = std::make_shared<Cloud>(*scene.cloud);
      for (float& t : cloud->threshold) t = static_cast<float>(t * factor);
      changed.cloud = cloud;
      return changed;
    };
    constexpr double kRounding = 2e-4;
    const Scene higher = with_threshold(1 + kRounding), lower = with_threshold(1 - kRounding);
    const Occlusion occlusion(scene, 2), above(higher, 2), below(lower, 2);
    Occlusion::Scratch scratch;
    std::mt19937 random(11);
    int shut = 0, open = 0, borderline = 0;
    for (int k = 0; k < 24; ++k) {
      const auto rays = GroupOf(*scene.cloud, s.radius, k % 3, &random);
      const std::vector<std::uint8_t> occluded = CastAll(occlusion, rays);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const bool expected = occlusion.CastOne(rays[i], &scratch);
        (expected ? shut : open) += 1;
        if ((occluded[i] != 0) == expected) continue;
        ++borderline;
        EXPECT_TRUE(below.CastOne(rays[i], &scratch)) << s.name << " " << k << " " << i;
        EXPECT_FALSE(above.CastOne(rays[i], &scratch)) << s.name << " " << k << " " << i;
      }
    }
    EXPECT_GT(shut, 100) << s.name;
    EXPECT_GT(open, 20) << s.name;
    EXPECT_LE(borderline, 2) << s.name;
  }
}

// A cloud in any order casts the same shadows.
TEST(Occlusion, DoesNotDependOnTheCloudsOrder) {
  const Scene scene = testing::SceneOf(testing::RandomBall(5000, 0.08, 2, 3), kThreshold);
  auto shuffled = std::make_shared<Cloud>(*scene.cloud);
  std::vector<std::uint32_t> order(shuffled->size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937 random(9);
  std::shuffle(order.begin(), order.end(), random);
  for (std::size_t i = 0; i < order.size(); ++i) {
    shuffled->center[i] = scene.cloud->center[order[i]];
    shuffled->radius[i] = scene.cloud->radius[order[i]];
  }
  Scene other = scene;
  other.cloud = shuffled;
  const double scale = ResolveDensity(scene.surface.density).support;
  EXPECT_TRUE(SupportTree(*scene.cloud, scale, 1).order.empty());
  EXPECT_EQ(SupportTree(*shuffled, scale, 1).order.size(), shuffled->size());
  const Occlusion one(scene, 1), two(other, 1);
  int shut = 0, different = 0;
  for (int k = 0; k < 12; ++k) {
    const auto rays = GroupOf(*scene.cloud, 0.05, k % 3, &random);
    const auto a = CastAll(one, rays), b = CastAll(two, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      shut += a[i];
      different += a[i] != b[i];
    }
  }
  EXPECT_GT(shut, 50);
  EXPECT_LE(different, 1);
}

// Every hit is in one group, and groups do not reach across the gap between near and far.
TEST(HitGroups, HoldEveryHitOnceAndStayTogether) {
  CloudInput input = testing::RandomBall(200, 0.3, 2, 23);
  for (Vec3d& c : input.center) c.z += c.x > 0 ? 40 : 0;
  const Scene scene = testing::SceneOf(input, kThreshold);
  const Camera camera = testing::FrontCamera(131, 77);
  RenderSettings settings;
  settings.planes = {.depth = true, .normal = true, .id = true};
  const Frame frame = MakeCpuRenderer()->Render(scene, camera, settings);
  std::vector<int> seen(frame.color.size(), 0);
  ForEachHitGroup(scene, camera, frame, 1, {}, [&](const std::vector<HitPoint>& group, int) {
    EXPECT_LE(group.size(), 64u);
    for (const HitPoint& hit : group) {
      ++seen[hit.pixel];
      EXPECT_LT(Length(hit.position - group[0].position) * scene.cloud->frame.unit, 20);
      EXPECT_NEAR(hit.radius, scene.cloud->RadiusOf(frame.id[hit.pixel]), 1e-9);
    }
  });
  for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(seen[i], frame.depth[i] > 0.0f ? 1 : 0);
}

}  // namespace
}  // namespace sherd
