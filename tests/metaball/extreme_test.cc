// Stiff and extreme scenes: each has a defined result.
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

TEST_P(ExtremeTest, NoMetaballsGiveAnEmptyPicture) {
  const Frame frame = Render(testing::SceneOf({}), testing::FrontCamera());
  EXPECT_EQ(frame.stats.hits, 0u);
  EXPECT_EQ(frame.color.size(), 96u * 64);
  for (const Pixel& p : frame.color) ASSERT_EQ(p.a, 0.0f);
}

TEST_P(ExtremeTest, CameraInsideTheSurfaceHitsAtOnceAndSaysSo) {
  const Scene scene = testing::SceneOf(testing::OneMetaball());
  const Camera camera = Camera::LookAt({0.01, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1.0, 32, 32);
  const Frame frame = Render(scene, camera);
  EXPECT_EQ(frame.stats.rays_started_inside, 32u * 32);
  EXPECT_EQ(frame.stats.hits, 32u * 32);
  for (const float depth : frame.depth) {
    ASSERT_GT(depth, 0.0f);  // 0 would mean that nothing is hit
    ASSERT_LT(depth, 1e-6f);
  }
}

TEST_P(ExtremeTest, CameraInsideTheSupportButOutsideTheSurface) {
  ExpectAgrees(testing::SceneOf(testing::RandomBall(500, 0.5, 3, 2)),
               Camera::LookAt({0, 0, -1.2}, {0, 0.2, 0}, {0, 1, 0}, 1.5, 80, 60));
}

TEST_P(ExtremeTest, CameraInTheMiddleOfAHollow) {
  CloudInput input = testing::RandomBall(4000, 0.12, 1, 3);
  for (Vec3d& p : input.center) p = Normalized(p);
  ExpectAgrees(testing::SceneOf(input),
               Camera::LookAt({0, 0, 0}, {0.3, 0.2, 1}, {0, 1, 0}, 2.0, 80, 60));
}

TEST_P(ExtremeTest, RadiiOverSixOrdersOfMagnitude) {
  ExpectAgrees(testing::SceneOf(testing::RandomBall(3000, 0.5, 1e6, 4)),
               testing::FrontCamera(80, 60));
  // And the small ones alone in a close view of one of them.
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

TEST_P(ExtremeTest, TenThousandMetaballsAtOnePlace) {
  CloudInput input;
  input.center.assign(10000, {0.1, 0.2, 0.3});
  input.uniform_radius = 1.0;
  const Scene scene = testing::SceneOf(input);
  const Frame frame = Render(scene, testing::FrontCamera(48, 32));
  const FrameDifference d = Compare(scene, testing::FrontCamera(48, 32), frame);
  // A sum of 10^4 nearly vanishing floats: the surface lies where each is 7e-5, near the rim.
  EXPECT_EQ(d.missed + d.invented, 0u) << d.Describe();
  EXPECT_LE(d.depth_max, 1e-4) << d.Describe();
  EXPECT_EQ(frame.stats.unresolved, 0u);
}

TEST_P(ExtremeTest, AHundredThousandMetaballsInOneCell) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(-1, 1);
  CloudInput input;
  input.center.push_back({1, 1, 1});  // gives the scene its extent
  for (int i = 0; i < 100000; ++i) {
    input.center.push_back(
        {1e-4 * uniform(random), 1e-4 * uniform(random), 1e-4 * uniform(random)});
  }
  input.uniform_radius = 0.3;
  const Frame frame = Render(testing::SceneOf(input, 100.0), testing::FrontCamera(24, 16));
  EXPECT_GT(frame.stats.hits, 0u);
  EXPECT_EQ(frame.stats.unresolved, 0u);
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

TEST_P(ExtremeTest, ACameraAMillionRadiiAway) {
  CloudInput input = testing::RandomBall(500, 0.3, 2, 7);
  const Scene scene = testing::SceneOf(input);
  const Camera camera = Camera::LookAt({0, 0, -3e5}, {0, 0, 0}, {0, 1, 0}, 1e-5, 64, 48);
  const Frame frame = Render(scene, camera);
  FrameDifference d = Compare(scene, camera, frame);
  EXPECT_EQ(d.missed + d.invented + d.color_off, 0u) << d.Describe();
  EXPECT_GT(frame.stats.hits, 100u);
  // The depth plane is float: at 3e5 its own steps are 0.03. The normals show that the hit itself
  // is exact.
  EXPECT_LT(d.normal_max_deg, 0.1) << d.Describe();
}

TEST_P(ExtremeTest, RaysAlongARowOfCentres) {
  CloudInput input;
  for (int i = 0; i < 1000; ++i) input.center.push_back({0, 0, i * 0.01});
  input.uniform_radius = 0.02;
  ExpectAgrees(testing::SceneOf(input, 0.7),
               Camera::LookAt({0, 0, -1}, {0, 0, 0}, {0, 1, 0}, 0.1, 65, 65));
}

TEST_P(ExtremeTest, CancellingNormalsStayFinite) {
  // Seen from the middle between two equal metaballs, where the gradient vanishes.
  CloudInput input;
  input.center = {{-0.5, 0, 0}, {0.5, 0, 0}};
  input.radius = {1, 1};
  Scene scene = testing::SceneOf(input, 2 * std::pow(1 - 0.25, 2));
  const Frame frame =
      Render(scene, Camera::LookAt({0, 0, -1e-3}, {0, 0, 1}, {0, 1, 0}, 1.0, 33, 33));
  for (const Vec3f& n : frame.normal) ASSERT_TRUE(IsFinite(n));
  for (const Pixel& p : frame.color) {
    ASSERT_TRUE(std::isfinite(p.r) && std::isfinite(p.g) && std::isfinite(p.b));
  }
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

TEST_P(ExtremeTest, OnePixelAndOddSizes) {
  const Scene scene = testing::SceneOf(testing::RandomBall(500, 0.3, 2, 9));
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 50}, {50, 1}, {7, 9}, {17, 31}}) {
    ExpectAgrees(scene, Camera::LookAt({0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 0.6, w, h));
  }
}

TEST_P(ExtremeTest, AVeryWidePicture) {
  const Scene scene = testing::SceneOf(testing::RandomBall(300, 0.3, 2, 10));
  const Camera camera = Camera::LookAt({0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 0.6, 32768, 2);
  ExpectAgrees(scene, camera);
}

INSTANTIATE_TEST_SUITE_P(Paths, ExtremeTest, ::testing::Values(CpuPath::kScalar, CpuPath::kBest),
                         [](const auto& param_info) {
                           return param_info.param == CpuPath::kScalar ? "Scalar" : "Best";
                         });

}  // namespace
}  // namespace sherd
