// Appearances on the frame pipeline: its planes are shaded by the same passes as the CPU's.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cuda/host_loop.h"
#include "datasets_synthetic/peer_scenes.h"
#include "metaball/moving.h"
#include "metaball/renderer.h"

namespace sherd {
namespace {

TEST(PipelineAppearance, PassesWorkOnItsPlanes) {
  PeerScene field = MakeHeightField(3000, 120, 80);
  Scene& scene = field.scene;
  scene.appearance.color = ColorSource::kQuantity;
  scene.appearance.pseudo.quantity = Quantity::kCameraDistance;
  scene.appearance.lights = {Light{.kind = LightKind::kDirectional, .to_light = {1, 1, 2}}};
  scene.appearance.shadows.enabled = true;
  scene.appearance.filter = 3;
  RenderSettings settings;
  settings.supersample = 2;
  const Frame cpu = MakeCpuRenderer()->Render(scene, field.camera, settings);
  const Frame gpu = MakeHostLoopRenderer()->Render(scene, field.camera, settings);
  ASSERT_EQ(gpu.color.size(), cpu.color.size());
  EXPECT_TRUE(gpu.depth.empty());
  std::size_t off = 0, lit = 0;
  for (std::size_t i = 0; i < cpu.color.size(); ++i) {
    off += std::abs(cpu.color[i].g - gpu.color[i].g) > 0.01f;
    lit += cpu.color[i].g > 0.02f;
  }
  EXPECT_GT(lit, 2000u);
  EXPECT_LT(off, cpu.color.size() / 200);  // rims and the borders of shadows
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
