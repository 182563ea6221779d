// Extremes beside those of the table (stiff_cases_test.cc).
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metaball/cpu_renderer.h"
#include "metaball/frame_difference.h"
#include "test_scenes.h"

namespace sherd {
namespace {

class ExtremeTest : public ::testing::TestWithParam<CpuPath> {
 protected:
  Frame Render(const Scene& scene, const Camera& camera) {
    RenderSettings settings;
    settings.planes = {true, true, true};
    return renderer_->Render(scene, camera, settings);
  }
  FrameDifference Compare(const Scene& scene, const Camera& camera, const Frame& frame) {
    return CompareToReference(frame, ReferenceRender(scene, camera), scene.cloud->frame.unit);
  }
  void ExpectAgrees(const Scene& scene, const Camera& camera) {
    const Frame frame = Render(scene, camera);
    const FrameDifference d = Compare(scene, camera, frame);
    EXPECT_EQ(d.missed + d.invented + d.color_off, 0u) << d.Describe();
    EXPECT_LE(d.depth_max, 1e-4) << d.Describe();
    EXPECT_EQ(frame.stats.unresolved, 0u);
  }
  std::unique_ptr<Renderer> renderer_ = MakeCpuRenderer(GetParam());
};

TEST_P(ExtremeTest, RadiiOverSixOrdersOfMagnitude) {
  // One of the smallest alone in a close view.
  const CloudInput input = testing::RandomBall(3000, 0.5, 1e6, 4);
  std::size_t smallest = 0;
  for (std::size_t i = 0; i < input.radius.size(); ++i) {
    if (input.radius[i] < input.radius[smallest]) smallest = i;
  }
  const Vec3d at = input.center[smallest];
  const double r = input.radius[smallest];
  CloudInput alone;
  alone.center = {at, {5, 5, 5}};
  alone.radius = {r, 1};
  // Centres are floats of the whole scene: the small one is placed to about 1e-7 of its extent.
  const Scene scene = testing::SceneOf(alone, 0.5);
  const Camera camera = Camera::LookAt(at + Vec3d{0, 0, -30 * r}, at, {0, 1, 0}, 0.3, 64, 64);
  const FrameDifference d = Compare(scene, camera, Render(scene, camera));
  EXPECT_EQ(d.missed + d.invented, 0u) << d.Describe();
}

TEST_P(ExtremeTest, ThresholdsAtTheEndsOfTheRange) {
  Scene scene = testing::SceneOf(testing::OneMetaball());
  for (const double threshold : {1e-6, 0.5, 0.999}) {
    scene.surface.threshold = threshold;
    ExpectAgrees(scene, testing::FrontCamera(120, 90));
  }
  // Above the highest field nothing is drawn.
  scene.surface.threshold = 1.0001;
  EXPECT_EQ(Render(scene, testing::FrontCamera()).stats.hits, 0u);
  scene.surface.threshold = 1e30;
  EXPECT_EQ(Render(scene, testing::FrontCamera()).stats.hits, 0u);
}

TEST_P(ExtremeTest, DenormalAndHugeRadiiAndCoordinates) {
  // Each alone: the local frame brings any scale to 1.
  for (const double scale : {1e-300, 1e-30, 1e30, 1e150}) {
    CloudInput input = testing::OneMetaball({0, 0, 0}, scale);
    const Camera camera = Camera::LookAt({0, 0, -3 * scale}, {0, 0, 0}, {0, 1, 0}, 1.0, 33, 33);
    const Frame frame = Render(testing::SceneOf(input), camera);
    EXPECT_EQ(frame.stats.hits, 49u) << scale;
    EXPECT_EQ(frame.stats.unresolved, 0u);
  }
  // Together: the small one cannot be seen, the picture is finite.
  CloudInput input;
  input.center = {{0, 0, 0}, {1, 0, 0}};
  input.radius = {1e-40, 1e30};
  const Frame frame = Render(testing::SceneOf(input), testing::FrontCamera(16, 16));
  for (const Pixel& p : frame.color) ASSERT_TRUE(std::isfinite(p.r));
}

// A tile that floats give up is drawn once more in doubles, and nothing of the first try is left: a
// row of single metaballs leads into a crowd, so that some rays of a tile hit before others meet
// it.
TEST_P(ExtremeTest, CrowdsAreDrawnInDoublesAndCountedOnce) {
  CloudInput input;
  for (int i = 0; i < 2000; ++i) input.center.push_back({0.3, 0.01, 0.02});
  for (int i = 0; i < 20; ++i) input.center.push_back({-1.0 + 0.1 * i, 0.1, -1.5});
  input.uniform_radius = 0.9;
  Channel channel("value", ChannelType::kFloat32, 1, input.center.size());
  for (std::size_t i = 0; i < input.center.size(); ++i) channel.Set(i, {{0.25f, 0, 0, 0}});
  input.channels = {channel};
  const Scene scene = testing::SceneOf(input, 0.9);
  const Camera camera = testing::FrontCamera(48, 32);
  ExpectAgrees(scene, camera);
  RenderSettings settings;
  settings.planes.depth = true;
  settings.planes.channels = {"value"};
  const Frame frame = renderer_->Render(scene, camera, settings);
  std::uint64_t hits = 0;
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    hits += frame.depth[i] > 0 ? 1 : 0;
    ASSERT_NEAR(frame.channels[0].values[i], frame.depth[i] > 0 ? 0.25 : 0, 1e-4);
  }
  EXPECT_EQ(frame.stats.hits, hits);
}

TEST_P(ExtremeTest, OnePixelAndOddSizes) {
  const Scene scene = testing::SceneOf(testing::RandomBall(500, 0.3, 2, 9));
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 50}, {50, 1}, {7, 9}, {17, 31}}) {
    ExpectAgrees(scene, Camera::LookAt({0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 0.6, w, h));
  }
}

INSTANTIATE_TEST_SUITE_P(Paths, ExtremeTest, ::testing::Values(CpuPath::kScalar, CpuPath::kBest),
                         [](const auto& param_info) {
                           return param_info.param == CpuPath::kScalar ? "Scalar" : "Best";
                         });

}  // namespace
}  // namespace sherd
