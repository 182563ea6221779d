// The planes beyond colour, depth, normal and id: the kernels against the CPU renderer.
#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "appearance_scenes.h"
#include "cuda/host_loop.h"
#include "metaball/error.h"
#include "metaball/moving.h"
#include "metaball/renderer.h"
#include "picture_difference.h"

namespace sherd {
namespace {

const std::vector<FeatureScene>& Scenes() {
  static const std::vector<FeatureScene> scenes = MakePlaneScenes();
  return scenes;
}

class PlanesTest : public ::testing::TestWithParam<std::size_t> {};

TEST_P(PlanesTest, AreThoseOfTheCpu) {
  const FeatureScene& feature = Scenes()[GetParam()];
  for (const int supersample : {1, 2}) {
    RenderSettings settings;
    settings.supersample = supersample;
    settings.planes = feature.planes;
    const Frame cpu = MakeCpuRenderer()->Render(feature.scene, feature.camera, settings);
    const Frame own = MakeHostLoopRenderer()->Render(feature.scene, feature.camera, settings);
    const PictureDifference d = ComparePictures(cpu, own, {.depth = feature.depth_tolerance});
    EXPECT_EQ(d.shape, "");
    EXPECT_GT(d.drawn, 1500u);
    EXPECT_LE(d.color_off, feature.colors_off * static_cast<double>(d.pixels));
    EXPECT_LE(d.elsewhere, d.drawn / 500);
    EXPECT_EQ(d.planes_off, 0u);
    EXPECT_LE(d.ids_off, 2 + d.drawn / 1000);
  }
}

INSTANTIATE_TEST_SUITE_P(All, PlanesTest, ::testing::Range(std::size_t{0}, Scenes().size()),
                         [](const auto& param_info) { return Scenes()[param_info.param].name; });

TEST(Planes, OnlyThoseThatAreAskedForAreThere) {
  Scene scene;
  scene.cloud = MakeChannelCloud(0.15, 1);
  const Camera camera = Camera::LookAt({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 0.9, 30, 20);
  RenderSettings settings;
  settings.planes.intensity = true;
  RenderSettings every;
  every.planes = EveryPlane();
  const auto renderer = MakeHostLoopRenderer();
  const Frame first = renderer->Render(scene, camera, every);
  const Frame frame = renderer->Render(scene, camera, settings);
  EXPECT_TRUE(frame.depth.empty() && frame.weight.empty() && frame.influence.empty());
  EXPECT_TRUE(frame.light.empty());
  EXPECT_TRUE(frame.channels.empty() && frame.uv.empty());
  EXPECT_EQ(frame.intensity, first.intensity);
  EXPECT_EQ(frame.intensity, renderer->Render(scene, camera, every).intensity);
}

TEST(Planes, ChannelsThatAreNotThereAreRefusedInWords) {
  Scene scene;
  scene.cloud = MakeChannelCloud(0.15, 1);
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
