#include "metaball/lod_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"
#include "metaball/moving.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

RenderSettings AllPlanes() {
  RenderSettings settings;
  settings.planes = {.depth = true, .normal = true, .id = true};
  return settings;
}

TEST(LodRenderer, LargeMetaballsAreDrawnAsWithoutIt) {
  const Scene scene = testing::SceneOf(testing::RandomBall(300, 0.4, 3, 3));
  const Camera camera = testing::FrontCamera();
  const Frame plain = MakeCpuRenderer()->Render(scene, camera, AllPlanes());
  const Frame lod = MakeLodRenderer(MakeCpuRenderer())->Render(scene, camera, AllPlanes());
  EXPECT_EQ(plain.depth, lod.depth);
  EXPECT_EQ(plain.id, lod.id);
  EXPECT_EQ(lod.stats.lod_metaballs, 0u);
  EXPECT_EQ(lod.stats.lod_error_px, 0);
  EXPECT_EQ(lod.stats.lod_note, "");
}

// Metaballs of about 0.3 pixels: the same picture once pixels are averaged.
void ExpectSamePicture(const PeerScene& peer) {
  RenderSettings settings = AllPlanes();
  settings.supersample = 4;
  const Frame plain = MakeCpuRenderer()->Render(peer.scene, peer.camera, settings);
  const Frame lod =
      MakeLodRenderer(MakeCpuRenderer(), 0.5)->Render(peer.scene, peer.camera, settings);
  ASSERT_GT(lod.stats.lod_metaballs, 0u) << lod.stats.lod_note;
  EXPECT_LT(lod.stats.lod_metaballs, peer.scene.cloud->size() / 2);
  EXPECT_EQ(lod.stats.metaballs, peer.scene.cloud->size());
  EXPECT_GT(lod.stats.lod_error_px, 0);
  EXPECT_LT(lod.stats.lod_error_px, 0.5);
  EXPECT_GT(lod.stats.lod_bytes, 0u);

  double sum = 0, alpha = 0;
  int inner = 0;
  const int w = plain.width, h = plain.height;
  std::int32_t largest_id = -1;
  for (int y = 1; y < h - 1; ++y) {
    for (int x = 1; x < w - 1; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * w + x;
      largest_id = std::max(largest_id, lod.id[i]);
      // An outline may lie up to half a pixel elsewhere.
      ASSERT_LE(std::abs(plain.color[i].a - lod.color[i].a), 0.75f) << x << " " << y;
      alpha += plain.color[i].a - lod.color[i].a;
      if (plain.color[i].a < 1 || lod.color[i].a < 1) continue;
      ++inner;
      sum += std::abs(plain.color[i].r - lod.color[i].r) +
             std::abs(plain.color[i].g - lod.color[i].g) +
             std::abs(plain.color[i].b - lod.color[i].b);
    }
  }
  ASSERT_GT(inner, 300);
  EXPECT_LT(sum / (3 * inner), 0.02);
  EXPECT_LT(std::abs(alpha) / inner, 0.01);
  EXPECT_GT(largest_id, static_cast<std::int32_t>(lod.stats.lod_metaballs));
  EXPECT_LT(largest_id, static_cast<std::int32_t>(peer.scene.cloud->size()));
}

TEST(LodRenderer, AHeightFieldLooksTheSame) { ExpectSamePicture(MakeHeightField(250000, 40, 24)); }

TEST(LodRenderer, AShellLooksTheSame) { ExpectSamePicture(MakeShell(600000, 32, 24)); }

TEST(LodRenderer, WhatShowsSingleMetaballsIsDrawnFromAllOfThem) {
  const PeerScene peer = MakeHeightField(250000, 40, 24);
  const auto renderer = MakeLodRenderer(MakeCpuRenderer());
  RenderSettings settings;
  settings.planes.weight = true;
  Frame frame = renderer->Render(peer.scene, peer.camera, settings);
  EXPECT_EQ(frame.stats.lod_metaballs, 0u);
  EXPECT_NE(frame.stats.lod_note, "");
  Scene scene = peer.scene;
  scene.surface.mode = ThresholdMode::kGated;
  frame = renderer->Render(scene, peer.camera, {});
  EXPECT_EQ(frame.stats.lod_metaballs, 0u);
  EXPECT_NE(frame.stats.lod_note, "");
  scene = peer.scene;
  scene.appearance.color = ColorSource::kQuantity;
  frame = renderer->Render(scene, peer.camera, {});
  EXPECT_EQ(frame.stats.lod_metaballs, 0u);
  EXPECT_NE(frame.stats.lod_note, "");
  frame = renderer->Render(peer.scene, peer.camera, {});
  EXPECT_GT(frame.stats.lod_metaballs, 0u);
  EXPECT_EQ(frame.stats.lod_note, "");
}

TEST(LodRenderer, FollowsTheSurfaceAndACloudThatMoves) {
  CloudInput input;
  for (int j = 0; j < 100; ++j) {
    for (int i = 0; i < 100; ++i) input.center.push_back({0.01 * i - 0.5, 0.01 * j - 0.5, 0});
  }
  input.uniform_radius = 0.025;
  MovingCloud moving(input);
  Scene scene;
  scene.cloud = moving.cloud();
  const Camera camera = Camera::LookAt({0, 0, -8}, {0, 0, 0}, {0, 1, 0}, 0.3, 48, 48);
  RenderSettings settings;
  settings.planes.depth = true;
  const auto renderer = MakeLodRenderer(MakeCpuRenderer(), 2);
  const std::size_t middle = 24 * 48 + 24;
  Frame frame = renderer->Render(scene, camera, settings);
  ASSERT_GT(frame.stats.lod_metaballs, 0u);
  EXPECT_NEAR(frame.depth[middle], 8, 0.05);
  for (Vec3d& p : input.center) p.z += 0.3;
  moving.SetPositions(input.center);
  frame = renderer->Render(scene, camera, settings);
  ASSERT_GT(frame.stats.lod_metaballs, 0u);
  EXPECT_NEAR(frame.depth[middle], 8.3, 0.05);
  // Larger metaballs: what was fine enough no longer is.
  const double error_px = frame.stats.lod_error_px;
  scene.surface.radius_scale = 1.2;
  frame = renderer->Render(scene, camera, settings);
  EXPECT_NE(frame.stats.lod_error_px, error_px);
}

TEST(LodRenderer, RefusesAnErrorThatIsNone) {
  EXPECT_THROW(MakeLodRenderer(MakeCpuRenderer(), 0), Error);
  EXPECT_THROW(MakeLodRenderer(MakeCpuRenderer(), std::numeric_limits<double>::quiet_NaN()), Error);
}

}  // namespace
}  // namespace sherd
