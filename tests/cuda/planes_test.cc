// The planes beyond colour, depth, normal and id: the kernels against the CPU renderer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "cuda/host_loop.h"
#include "datasets_synthetic/random.h"
#include "metaball/appearance/uv_gradients.h"
#include "metaball/error.h"
#include "metaball/moving.h"
#include "metaball/renderer.h"

namespace sherd {
namespace {

constexpr int kMetaballs = 1500;

// Metaballs on a sphere of radius 1 with a channel of every type and coordinates around it.
std::shared_ptr<Cloud> MakeCloud(double radius, double spread) {
  synthetic::Rng random(7);
  CloudInput input;
  input.uniform_radius = radius;
  Channel height("height", ChannelType::kFloat32, 1, kMetaballs);
  Channel pair("pair", ChannelType::kUnorm16, 2, kMetaballs, -3, 5);
  Channel four("four", ChannelType::kUnorm8, 4, kMetaballs, 0, 1);
  Channel direction("direction", ChannelType::kOctahedral, 3, kMetaballs);
  Channel uv("uv", ChannelType::kFloat32, 2, kMetaballs);
  for (std::size_t i = 0; i < kMetaballs; ++i) {
    const Vec3d p = Normalized(
        Vec3d{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)}, {0, 0, 1});
    input.center.push_back(p);
    if (spread > 1) input.radius.push_back(radius * std::pow(spread, -random.Uniform()));
    input.color.push_back({static_cast<std::uint8_t>(random.Index(256)), 90, 200});
    input.threshold.push_back(random.Uniform(0.3, 0.9));
    height.Set(i, {{static_cast<float>(p.y)}});
    pair.Set(i, {{static_cast<float>(p.x), static_cast<float>(4 * p.z)}});
    four.Set(i, {{0.2f, static_cast<float>(random.Uniform()), 0.7f, 1.0f}});
    direction.Set(i, {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}});
    const double around = std::atan2(p.z, p.x) / (2 * std::numbers::pi) + 0.5;
    uv.Set(i, {{static_cast<float>(around), static_cast<float>(0.5 * p.y + 0.5)}});
  }
  input.channels = {height, pair, four, direction, uv};
  auto cloud = std::make_shared<Cloud>(BuildCloud(input));
  AddUvGradients(cloud.get(), "uv", true);
  return cloud;
}

RenderSettings EveryPlane(int supersample) {
  RenderSettings settings;
  settings.supersample = supersample;
  Planes& planes = settings.planes;
  planes.depth = planes.normal = planes.id = true;
  planes.weight = planes.intensity = planes.influence = true;
  planes.channels = {"four", "height", "direction", "pair"};
  planes.uv = {{"uv", true}};
  return settings;
}

struct Case {
  std::string name;
  ThresholdMode mode;
  double radius, spread;
};

class PlanesTest : public ::testing::TestWithParam<Case> {};

TEST_P(PlanesTest, AreThoseOfTheCpu) {
  const Case& c = GetParam();
  Scene scene;
  scene.cloud = MakeCloud(c.radius, c.spread);
  scene.surface.mode = c.mode;
  const Camera camera = Camera::LookAt({0.4, 0.6, -3}, {0, 0, 0}, {0, 1, 0}, 0.9, 90, 70);
  for (const int supersample : {1, 2}) {
    const RenderSettings settings = EveryPlane(supersample);
    const Frame cpu = MakeCpuRenderer()->Render(scene, camera, settings);
    const Frame own = MakeHostLoopRenderer()->Render(scene, camera, settings);
    ASSERT_EQ(own.weight.size(), cpu.weight.size());
    ASSERT_EQ(own.channels.size(), cpu.channels.size());
    ASSERT_EQ(own.uv.size(), 1u);
    EXPECT_EQ(own.uv[0].channel, "uv");
    std::size_t hits = 0, rims = 0;
    for (std::size_t i = 0; i < cpu.depth.size(); ++i) {
      // Where the two stop at different metaballs' rims nothing else is the same.
      if (std::abs(cpu.depth[i] - own.depth[i]) > 1e-4f * c.radius) {
        ++rims;
        continue;
      }
      hits += cpu.depth[i] > 0;
      ASSERT_NEAR(own.weight[i], cpu.weight[i], 2e-3) << i;
      ASSERT_NEAR(own.intensity[i], cpu.intensity[i], 2e-3) << i;
      ASSERT_LT(Length(own.influence[i] - cpu.influence[i]), 5e-3f) << i;
      for (std::size_t k = 0; k < cpu.channels.size(); ++k) {
        const ChannelPlane &a = cpu.channels[k], &b = own.channels[k];
        ASSERT_EQ(a.name, b.name);
        ASSERT_EQ(a.components, b.components);
        for (int j = 0; j < a.components; ++j) {
          const std::size_t at = i * static_cast<std::size_t>(a.components) + j;
          ASSERT_NEAR(a.values[at], b.values[at], 4e-3) << a.name << " at " << i;
        }
      }
      const SurfaceUv &p = cpu.uv[0].values[i], &q = own.uv[0].values[i];
      ASSERT_NEAR(p.u - q.u - std::round(p.u - q.u), 0, 2e-3) << i;
      ASSERT_NEAR(p.v, q.v, 2e-3) << i;
      ASSERT_LT(Length(p.du - q.du), 2e-2f) << i;
    }
    EXPECT_GT(hits, 1500u);
    EXPECT_LE(rims, hits / 500);
  }
}

INSTANTIATE_TEST_SUITE_P(All, PlanesTest,
                         ::testing::Values(Case{"uniform", ThresholdMode::kUniform, 0.15, 1},
                                           Case{"own_radii", ThresholdMode::kUniform, 0.2, 2},
                                           Case{"in_doubles", ThresholdMode::kUniform, 0.2, 120},
                                           Case{"blended", ThresholdMode::kBlended, 0.2, 2},
                                           Case{"blended_in_doubles", ThresholdMode::kBlended, 0.2,
                                                120},
                                           Case{"gated", ThresholdMode::kGated, 0.2, 2}),
                         [](const auto& param_info) { return param_info.param.name; });

TEST(Planes, OnlyThoseThatAreAskedForAreThere) {
  Scene scene;
  scene.cloud = MakeCloud(0.15, 1);
  const Camera camera = Camera::LookAt({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 0.9, 30, 20);
  RenderSettings settings;
  settings.planes.intensity = true;
  const auto renderer = MakeHostLoopRenderer();
  const Frame first = renderer->Render(scene, camera, EveryPlane(1));
  const Frame frame = renderer->Render(scene, camera, settings);
  EXPECT_TRUE(frame.depth.empty() && frame.weight.empty() && frame.influence.empty());
  EXPECT_TRUE(frame.channels.empty() && frame.uv.empty());
  EXPECT_EQ(frame.intensity, first.intensity);
  EXPECT_EQ(frame.intensity, renderer->Render(scene, camera, EveryPlane(1)).intensity);
}

TEST(Planes, ChannelsThatAreNotThereAreRefusedInWords) {
  Scene scene;
  scene.cloud = MakeCloud(0.15, 1);
  const Camera camera = Camera::LookAt({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 0.9, 30, 20);
  RenderSettings settings;
  settings.planes.channels = {"error"};
  EXPECT_THROW(MakeHostLoopRenderer()->Render(scene, camera, settings), Error);
  settings.planes.channels = {};
  settings.planes.uv = {{"height"}};
  EXPECT_THROW(MakeHostLoopRenderer()->Render(scene, camera, settings), Error);
}

TEST(Planes, FollowWhatChangesInACloud) {
  CloudInput input;
  input.center = {{0, 0, 0}, {0.5, 0, 0}};
  input.uniform_radius = 1;
  input.threshold = {0.5, 0.5};
  input.channels = {Channel("error", ChannelType::kFloat32, 1, 2)};
  MovingCloud moving(input);
  Scene scene;
  scene.cloud = moving.cloud();
  scene.surface.mode = ThresholdMode::kBlended;
  const Camera camera = Camera::LookAt({0, 0, -6}, {0, 0, 0}, {0, 1, 0}, 0.9, 31, 21);
  const std::size_t middle = 10 * 31 + 15;
  RenderSettings settings;
  settings.planes.channels = {"error"};
  const auto renderer = MakeHostLoopRenderer();
  const auto render = [&] { return renderer->Render(scene, camera, settings); };
  const Frame before = render();
  EXPECT_EQ(before.channels[0].values[middle], 0.0f);
  Channel error("error", ChannelType::kFloat32, 1, 2);
  for (std::size_t i = 0; i < 2; ++i) error.Set(i, {{4.0f}});
  moving.SetChannel(error);
  EXPECT_FLOAT_EQ(render().channels[0].values[middle], 4.0f);
  moving.SetThresholds(std::vector<double>{0.2, 0.2});
  EXPECT_GT(render().stats.hits, before.stats.hits + 10);
  moving.SetColors(std::vector<Rgb8>{{255, 0, 0}, {255, 0, 0}});
  EXPECT_EQ(render().color[middle].g, 0.0f);
}

}  // namespace
}  // namespace sherd
