// Appearances drawn by the kernels' bodies, against the CPU renderer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
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
  static const std::vector<FeatureScene> scenes = MakeAppearanceScenes();
  return scenes;
}

const FeatureScene& Named(const std::string& name) {
  return *std::find_if(Scenes().begin(), Scenes().end(),
                       [&](const FeatureScene& scene) { return scene.name == name; });
}

std::uint64_t PixelsOff(const Frame& a, const Frame& b, float tolerance) {
  return ComparePictures(a, b, {.color = tolerance}).color_off;
}

class AppearanceCases : public ::testing::TestWithParam<std::string> {};

TEST_P(AppearanceCases, AreThoseOfTheCpu) {
  const FeatureScene& feature = Named(GetParam());
  const Scene& scene = feature.scene;
  Scene plain = scene;
  plain.appearance = {};
  for (const int supersample : {1, 2}) {
    RenderSettings settings;
    settings.supersample = supersample;
    settings.planes.light = true;
    const Frame cpu = MakeCpuRenderer()->Render(scene, feature.camera, settings);
    const Frame own = MakeHostLoopRenderer()->Render(scene, feature.camera, settings);
    ASSERT_EQ(own.color.size(), cpu.color.size());
    EXPECT_TRUE(own.depth.empty() && own.normal.empty() && own.channels.empty() && own.uv.empty());
    EXPECT_LE(PixelsOff(cpu, own, 0.01f),
              feature.colors_off * static_cast<double>(cpu.color.size()));
    ASSERT_EQ(own.light.size(), cpu.light.size());
    std::size_t light_off = 0;
    for (std::size_t i = 0; i < cpu.light.size(); ++i) {
      light_off += !(Length(cpu.light[i] - own.light[i]) < 0.01f);
    }
    EXPECT_LE(static_cast<double>(light_off),
              feature.colors_off * static_cast<double>(cpu.light.size()));
    // It is not what is drawn without it.
    const Frame without = MakeCpuRenderer()->Render(plain, feature.camera, settings);
    EXPECT_GT(PixelsOff(own, without, 0.01f), 400u);
  }
}

INSTANTIATE_TEST_SUITE_P(All, AppearanceCases, ::testing::ValuesIn([] {
                           std::vector<std::string> names;
                           for (const FeatureScene& scene : Scenes()) names.push_back(scene.name);
                           return names;
                         }()),
                         [](const auto& param_info) { return param_info.param; });

TEST(PipelineAppearance, PartsOfAPictureMakeTheSamePicture) {
  const Scene& scene = Named("all_at_once").scene;
  const Camera& camera = Named("all_at_once").camera;
  RenderSettings settings;
  settings.planes.depth = true;
  settings.planes.channels = {"vector"};
  const Frame whole = MakeHostLoopRenderer()->Render(scene, camera, settings);
  HostLoopOptions options;
  options.memory_bytes = 900'000;
  const Frame parts = MakeHostLoopRenderer(options)->Render(scene, camera, settings);
  EXPECT_LT(parts.stats.bytes, options.memory_bytes);
  EXPECT_GT(whole.stats.bytes, options.memory_bytes);
  EXPECT_LE(PixelsOff(whole, parts, 1e-3f), whole.color.size() / 200);
  ASSERT_EQ(parts.channels.size(), 1u);
  for (std::size_t i = 0; i < whole.depth.size(); ++i) {
    ASSERT_NEAR(whole.depth[i], parts.depth[i], 1e-4);
    ASSERT_NEAR(whole.channels[0].values[3 * i], parts.channels[0].values[3 * i], 1e-3);
  }
}

// What a part of a picture needs is only estimated before it is drawn.
TEST(PipelineAppearance, OnceItDrawsMoreMemoryNeverRefuses) {
  const std::vector<FeatureScene> scenes = MakeAppearanceScenes(96, 64);
  RenderSettings settings;
  settings.supersample = 2;
  for (const char* name : {"quantity_intensity", "filter", "texture_planar", "shadows"}) {
    const auto scene = std::find_if(scenes.begin(), scenes.end(),
                                    [&](const FeatureScene& s) { return s.name == name; });
    std::uint64_t drawn = 0;
    for (std::uint64_t bytes = 160'000; bytes < 760'000; bytes += 24'000) {
      HostLoopOptions options;
      options.memory_bytes = bytes;
      try {
        MakeHostLoopRenderer(options)->Render(scene->scene, scene->camera, settings);
        ++drawn;
      } catch (const ResourceError& error) {
        EXPECT_EQ(drawn, 0u) << name << " with " << bytes << " bytes: " << error.what();
      }
    }
    EXPECT_GT(drawn, 10u) << name;
  }
}

TEST(PipelineAppearance, ShadowsFollowTheRadiusAndACloudThatLostItsOrder) {
  Scene scene = Named("shadows").scene;
  const Camera& camera = Named("shadows").camera;
  const auto renderer = MakeHostLoopRenderer();
  const auto cpu = MakeCpuRenderer();
  const auto expect_as_cpu = [&] {
    const Frame own = renderer->Render(scene, camera, {});
    EXPECT_LE(PixelsOff(cpu->Render(scene, camera, {}), own, 0.01f), own.color.size() / 50);
  };
  expect_as_cpu();
  scene.surface.radius_scale = 1.3;
  expect_as_cpu();
  auto shuffled = std::make_shared<Cloud>(*scene.cloud);
  const std::size_t n = shuffled->size();
  for (std::size_t i = 0; i < n; ++i) {  // a permutation far from any order in space
    const std::size_t k = i * 1237 % n;
    shuffled->center[i] = scene.cloud->center[k];
    shuffled->radius[i] = scene.cloud->radius[k];
    shuffled->color[i] = scene.cloud->color[k];
  }
  scene.cloud = shuffled;
  expect_as_cpu();
}

TEST(PipelineAppearance, WhatCannotBeDrawnIsRefusedInWords) {
  Scene scene = Named("volume").scene;
  const Camera& camera = Named("volume").camera;
  scene.appearance.volume = nullptr;
  EXPECT_THROW(MakeHostLoopRenderer()->Render(scene, camera, {}), Error);
  scene = Named("filter").scene;
  scene.appearance.filter = 4;
  EXPECT_THROW(MakeHostLoopRenderer()->Render(scene, camera, {}), Error);
}

// A cloud that moved is brought over anew, though it is the same object.
TEST(PipelineAppearance, SeesThatACloudMoved) {
  CloudInput input;
  input.center = {{0, 0, 0}, {0.5, 0, 0}};
  input.uniform_radius = 1;
  MovingCloud moving(input);
  Scene scene;
  scene.cloud = moving.cloud();
  const Camera camera = Camera::LookAt({0, 0, -6}, {0, 0, 0}, {0, 1, 0}, 0.9, 60, 40);
  const auto renderer = MakeHostLoopRenderer();
  const auto cpu = MakeCpuRenderer();
  std::uint64_t before = 0;
  const auto expect_new_picture = [&] {
    const std::uint64_t hits = renderer->Render(scene, camera, {}).stats.hits;
    EXPECT_NEAR(static_cast<double>(hits),
                static_cast<double>(cpu->Render(scene, camera, {}).stats.hits), 2);
    EXPECT_GT(std::max(hits, before) - std::min(hits, before), 20u);
    before = hits;
  };
  expect_new_picture();
  input.center[1] = {1.5, 0, 0};
  moving.SetPositions(input.center);
  expect_new_picture();
  moving.SetUniformRadius(0.5);
  expect_new_picture();
}

}  // namespace
}  // namespace sherd
