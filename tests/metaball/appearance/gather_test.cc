// The further planes against sums over every metaball in double precision.
#include "metaball/appearance/gather.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "metaball/appearance/neighbors.h"
#include "metaball/appearance/uv_gradients.h"
#include "metaball/cpu_renderer.h"
#include "metaball/error.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

Scene SceneWithChannels(unsigned seed) {
  CloudInput input = testing::RandomBall(300, 0.35, 3, seed);
  const std::size_t n = input.center.size();
  Channel value("value", ChannelType::kFloat32, 1, n);
  Channel direction("direction", ChannelType::kOctahedral, 3, n);
  Channel quad("quad", ChannelType::kUnorm16, 4, n, -2.0f, 5.0f);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (std::size_t i = 0; i < n; ++i) {
    value.Set(i, {{100 * uniform(random)}});
    direction.Set(i, {{uniform(random), uniform(random), uniform(random)}});
    quad.Set(i, {{uniform(random), 2 * uniform(random), 1 + uniform(random), 4.5f}});
  }
  input.channels = {value, direction, quad};
  return testing::SceneOf(input);
}

struct Sums {
  double weight = 0, squares = 0;
  Vec3d influence{};
  double value[3][4] = {};
};

Sums SumsAt(const Cloud& cloud, const Vec3d& point) {
  Sums sums;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3d offset = point - cloud.center[i].cast<double>();
    const double r = cloud.RadiusOf(i);
    const double q = 1 - Dot(offset, offset) / (r * r);
    if (q <= 0) continue;
    const double f = q * q;
    sums.weight += f;
    sums.squares += f * f;
    sums.influence += Normalized(offset, Vec3d{}) * f;
    for (int c = 0; c < 3; ++c) {
      const ChannelValue value = cloud.channels[c].Get(i);
      for (int k = 0; k < 4; ++k) sums.value[c][k] += f * value.v[k];
    }
  }
  return sums;
}

class Gather : public ::testing::TestWithParam<CpuPath> {};

TEST_P(Gather, EqualsTheSumsOverAllMetaballs) {
  const Scene scene = SceneWithChannels(3);
  const Camera camera = testing::FrontCamera();
  RenderSettings settings;
  settings.planes = {.depth = true, .weight = true, .intensity = true, .influence = true};
  settings.planes.channels = {"quad", "value", "direction"};
  const Frame frame = MakeCpuRenderer(GetParam())->Render(scene, camera, settings);
  ASSERT_EQ(frame.channels.size(), 3u);
  EXPECT_EQ(frame.channels[0].components, 4);
  EXPECT_EQ(frame.channels[1].name, "value");
  const Cloud& cloud = *scene.cloud;
  const int plane_of[3] = {1, 2, 0};  // of the cloud's channels, in the order asked for
  std::size_t hits = 0;
  for (std::size_t p = 0; p < frame.depth.size(); ++p) {
    if (frame.depth[p] == 0.0f) {
      EXPECT_EQ(frame.weight[p], 0.0f);
      EXPECT_EQ(frame.channels[1].values[p], 0.0f);
      continue;
    }
    ++hits;
    const RayD ray = RayThrough(camera, p % frame.width + 0.5, p / frame.width + 0.5);
    const Sums sums = SumsAt(
        cloud, cloud.frame.LocalFromWorld(ray.origin + ray.direction * double{frame.depth[p]}));
    EXPECT_NEAR(frame.weight[p], sums.weight, 2e-5);
    EXPECT_NEAR(frame.intensity[p], sums.squares / sums.weight, 2e-5);
    EXPECT_LT(Length(frame.influence[p].cast<double>() - sums.influence / sums.weight), 2e-4);
    for (int c = 0; c < 3; ++c) {
      const ChannelPlane& plane = frame.channels[plane_of[c]];
      for (int k = 0; k < plane.components; ++k) {
        EXPECT_NEAR(plane.values[p * plane.components + k], sums.value[c][k] / sums.weight,
                    c == 0 ? 5e-3 : 2e-4);
      }
    }
  }
  EXPECT_GT(hits, 1000u);
}

// Another density, scaled: F counts its amplitude, the weights are its own. Gated thresholds take
// the values of the one metaball whose sphere was hit.
TEST_P(Gather, FollowsTheDensityAndTheThresholds) {
  Scene scene = SceneWithChannels(6);
  scene.surface.density.kind = DensityKind::kWyvill;
  scene.surface.threshold = 0.4;
  const Camera camera = testing::FrontCamera();
  RenderSettings settings;
  settings.planes = {.depth = true, .id = true, .weight = true};
  settings.planes.channels = {"value"};
  const auto renderer = MakeCpuRenderer(GetParam());
  const Frame frame = renderer->Render(scene, camera, settings);
  scene.surface.mode = ThresholdMode::kGated;
  const Frame gated = renderer->Render(scene, camera, settings);
  scene.surface = {.threshold = 2.0};
  scene.surface.density = {.kind = DensityKind::kBlinn, .rate = 16, .amplitude = 5};
  const Frame blinn = renderer->Render(scene, camera, settings);
  int hits = 0, gated_hits = 0, blinn_hits = 0;
  for (std::size_t p = 0; p < frame.depth.size(); ++p) {
    if (frame.depth[p] > 0) {
      ++hits;
      EXPECT_NEAR(frame.weight[p], 0.4, 2e-3);
    }
    if (blinn.depth[p] > 0) {
      ++blinn_hits;
      EXPECT_NEAR(blinn.weight[p], 2.0, 2e-2);
    }
    if (gated.depth[p] > 0) {
      ++gated_hits;
      EXPECT_NEAR(gated.channels[0].values[p],
                  scene.cloud->FindChannel("value")->Get(gated.id[p]).v[0], 1e-3);
    }
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(gated_hits, 500);
  EXPECT_GT(blinn_hits, 200);
}

TEST_P(Gather, LeavesTheOtherPlanesAlone) {
  const Scene scene = SceneWithChannels(4);
  RenderSettings plain, more;
  more.planes.channels = {"value"};
  const auto renderer = MakeCpuRenderer(GetParam());
  const Frame a = renderer->Render(scene, testing::FrontCamera(), plain);
  const Frame b = renderer->Render(scene, testing::FrontCamera(), more);
  EXPECT_TRUE(a.channels.empty() && a.weight.empty() && a.uv.empty());
  EXPECT_EQ(0, std::memcmp(a.color.data(), b.color.data(), a.color.size() * sizeof(Pixel)));
}

TEST_P(Gather, SupersamplingTakesTheMiddleSample) {
  const Scene scene = SceneWithChannels(5);
  const Camera camera = testing::FrontCamera(24, 16);
  RenderSettings settings;
  settings.planes.channels = {"quad"};
  settings.planes.weight = true;
  const auto renderer = MakeCpuRenderer(GetParam());
  const Frame fine = renderer->Render(scene, camera.Resized(72, 48), settings);
  settings.supersample = 3;
  const Frame frame = renderer->Render(scene, camera, settings);
  ASSERT_EQ(frame.channels[0].values.size(), 24u * 16 * 4);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 24; ++x) {
      const std::size_t from = static_cast<std::size_t>(3 * y + 1) * 72 + 3 * x + 1;
      EXPECT_EQ(frame.weight[y * 24 + x], fine.weight[from]);
      EXPECT_EQ(frame.channels[0].values[(y * 24 + x) * 4 + 2],
                fine.channels[0].values[from * 4 + 2]);
    }
  }
}

TEST_P(Gather, NamesTheChannelsThereAre) {
  RenderSettings settings;
  settings.planes.channels = {"height"};
  try {
    MakeCpuRenderer(GetParam())->Render(SceneWithChannels(1), testing::FrontCamera(), settings);
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the cloud has no channel 'height'; it has value, direction, quad");
  }
  settings.planes.channels = {};
  settings.planes.uv = {{"value"}};
  EXPECT_THROW(
      MakeCpuRenderer(GetParam())->Render(SceneWithChannels(1), testing::FrontCamera(), settings),
      Error);
}

INSTANTIATE_TEST_SUITE_P(Paths, Gather, ::testing::Values(CpuPath::kBest, CpuPath::kScalar));

TEST(NeighborIndex, FindsWhatASearchOverAllPointsFinds) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<Vec3f> points;
  for (int i = 0; i < 700; ++i) points.push_back({uniform(random), uniform(random), 0.0f});
  for (int i = 0; i < 60; ++i) points.push_back(points[3]);  // duplicates
  const NeighborIndex index(points);
  std::vector<NeighborIndex::Neighbor> found;
  for (int q = 0; q < 50; ++q) {
    const Vec3f query{uniform(random), uniform(random), 0.2f * uniform(random)};
    std::vector<std::pair<float, std::uint32_t>> all;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      all.emplace_back(Dot(points[i] - query, points[i] - query), i);
    }
    std::sort(all.begin(), all.end());
    index.Nearest(query, 9, &found);
    ASSERT_EQ(found.size(), 9u);
    for (int k = 0; k < 9; ++k) EXPECT_EQ(found[k].idx, all[k].second);
  }
  index.Nearest({0, 0, 0}, 5000, &found);
  EXPECT_EQ(found.size(), points.size());
}

TEST(UvGradients, AreExactForALinearMapAndShortAcrossASeam) {
  CloudInput input;
  input.uniform_radius = 0.2;
  for (int j = 0; j < 20; ++j) {
    for (int i = 0; i < 20; ++i) input.center.push_back({0.1 * i, 0.1 * j, 0});
  }
  Channel uv("uv", ChannelType::kFloat32, 2, input.center.size());
  for (std::size_t i = 0; i < input.center.size(); ++i) {
    const Vec3d& p = input.center[i];
    const double u = 0.3 * p.x + 0.1 * p.y + 0.7;
    uv.Set(i, {{static_cast<float>(u - std::floor(u)), static_cast<float>(0.4 * p.y)}});
  }
  input.channels = {uv};
  Cloud cloud = BuildCloud(input);
  AddUvGradients(&cloud, "uv", true);
  AddUvGradients(&cloud, "uv", true);  // replaces
  EXPECT_EQ(cloud.channels.size(), 3u);
  const Channel& du = ChannelNamed(cloud, "uv.du");
  const Channel& dv = ChannelNamed(cloud, "uv.dv");
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_NEAR(du.Get(i).v[0], 0.3, 1e-4);
    EXPECT_NEAR(du.Get(i).v[1], 0.1, 1e-4);
    EXPECT_NEAR(du.Get(i).v[2], 0.0, 1e-6);
    EXPECT_NEAR(dv.Get(i).v[1], 0.4, 1e-4);
  }
  // Not periodic: the jump from 1 to 0 is a seam between charts, left out of the fit.
  AddUvGradients(&cloud, "uv", false);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_NEAR(ChannelNamed(cloud, "uv.du").Get(i).v[0], 0.3, 1e-3);
  }
}

TEST(Spacing, OfALatticeIsKnown) {
  CloudInput input;
  input.uniform_radius = 0.2;
  for (int k = 0; k < 5; ++k) {
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 5; ++i) input.center.push_back({100.0 + i, 1.0 * j, 1.0 * k});
    }
  }
  Cloud cloud = BuildCloud(input);
  AddSpacingChannel(&cloud);
  int inner = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3d p = cloud.frame.WorldFromLocal(cloud.center[i]) - Vec3d{100, 0, 0};
    const float spacing = cloud.channels[0].Get(i).v[0];
    if (std::min({p.x, p.y, p.z}) > 0.5 && std::max({p.x, p.y, p.z}) < 3.5) {
      EXPECT_FLOAT_EQ(spacing, 1.0f);
      ++inner;
    } else {
      EXPECT_GT(spacing, 1.0f);
    }
  }
  EXPECT_EQ(inner, 27);
}

}  // namespace
}  // namespace sherd
