// Every density and threshold mode on the CPU, both paths, against the double-precision reference.
#include <gtest/gtest.h>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/cpu_renderer.h"
#include "metaball/density/shapes.h"
#include "metaball/error.h"
#include "metaball/frame_difference.h"
#include "test_scenes.h"

namespace sherd {
namespace {

class ModelsTest : public ::testing::TestWithParam<testing::PathAndMode> {
 protected:
  void ExpectAgreesWithReference(const Scene& scene, const Camera& camera) {
    const std::string what = TextOf(scene.surface.density);
    const Frame frame = testing::RenderPlanes(renderer_.get(), scene, camera);
    const FrameDifference d =
        CompareToReference(frame, ReferenceRender(scene, camera), scene.cloud->frame.unit);
    EXPECT_EQ(d.missed, 0u) << what << ": " << d.Describe();
    EXPECT_EQ(d.invented, 0u) << what << ": " << d.Describe();
    // On the rim of a support it is rounding that says whether the metaball belongs to the sums.
    // That shows where its density does not end smoothly: here and there, and with summed
    // thresholds on whole surfaces, which then are rims.
    const DensityShape shape = ResolveDensity(scene.surface.density).shape;
    const bool smooth_rim = std::abs(ShapeSlope(shape, 1 - 1e-9)) < 1e-3;
    // Where two supports begin and end at nearly the same place, summed thresholds may be passed
    // for less than the tolerance of path, or rounding may turn the two around: the reference takes
    // such a place, the renderer may not.
    const bool summed = scene.surface.mode == ThresholdMode::kSummed;
    const bool jumps = summed && (!smooth_rim || frame.stats.grazing > 0);
    EXPECT_LE(jumps ? d.depth_p99 : d.depth_max, 1e-4) << what << ": " << d.Describe();
    if (!summed || smooth_rim) {
      EXPECT_LE(d.color_off, smooth_rim ? 0 : d.pixels / 1000) << what << ": " << d.Describe();
    }
    EXPECT_EQ(frame.stats.unresolved, 0u) << what;
    EXPECT_GT(frame.stats.hits, frame.stats.rays / 100) << what;
  }

  std::unique_ptr<Renderer> renderer_ = MakeCpuRenderer(GetParam().path);
};

TEST_P(ModelsTest, EveryDensityOnARandomBall) {
  const ThresholdMode mode = GetParam().mode;
  testing::ForEveryDensity(mode, [&](const DensityModel& model) {
    const double threshold = testing::ThresholdFor(model, mode);
    Scene scene =
        testing::SceneOf(testing::BallWithThresholds(400, 0.3, 4.0, 11, threshold), threshold);
    scene.surface.density = model;
    scene.surface.mode = mode;
    ExpectAgreesWithReference(scene, testing::FrontCamera(80, 60));
  });
}

TEST_P(ModelsTest, EveryDensityOnAHeightField) {
  const ThresholdMode mode = GetParam().mode;
  testing::ForEveryDensity(mode, [&](const DensityModel& model) {
    PeerScene peer = MakeHeightField(2500, 128, 72);
    peer.scene.surface.density = model;
    peer.scene.surface.mode = mode;
    peer.scene.surface.threshold = testing::ThresholdFor(model, mode);
    ExpectAgreesWithReference(peer.scene, peer.camera);
  });
}

INSTANTIATE_TEST_SUITE_P(All, ModelsTest, testing::EveryPathAndMode(), testing::NameOfPathAndMode);

TEST(ThresholdModes, BlendedEqualsUniformWhereAllThresholdsAreEqual) {
  const PeerScene uniform = MakeHeightField(2500, 160, 90);
  PeerScene blended = uniform;
  blended.scene.surface.mode = ThresholdMode::kBlended;
  RenderSettings settings;
  settings.planes = {true, true, true};
  const auto renderer = MakeCpuRenderer();
  const Frame a = renderer->Render(uniform.scene, uniform.camera, settings);
  const Frame b = renderer->Render(blended.scene, blended.camera, settings);
  const double radius = uniform.scene.cloud->uniform_radius * uniform.scene.cloud->frame.unit;
  for (std::size_t i = 0; i < a.depth.size(); ++i) {
    ASSERT_EQ(a.depth[i] > 0, b.depth[i] > 0);
    ASSERT_NEAR(a.depth[i], b.depth[i], 1e-4 * radius);
    ASSERT_NEAR(Dot(a.normal[i], b.normal[i]), a.depth[i] > 0 ? 1 : 0, 1e-4);
  }
}

TEST(ThresholdModes, GatedIsAUnionOfSpheres) {
  // Two metaballs whose fields together pass the threshold between them, where neither does alone.
  CloudInput input;
  input.center = {{-0.75, 0, 0}, {0.75, 0, 0}};
  input.uniform_radius = 1.0;
  input.threshold = {0.35, 0.35};
  Scene scene = testing::SceneOf(input, 0.35);
  const Camera camera = Camera::LookAt({0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 0.6, 65, 65);
  const auto renderer = MakeCpuRenderer();
  const std::size_t middle = 32 * 65 + 32;
  EXPECT_EQ(renderer->Render(scene, camera, {}).color[middle].a, 1.0f);
  scene.surface.mode = ThresholdMode::kGated;
  EXPECT_EQ(renderer->Render(scene, camera, {}).color[middle].a, 0.0f);
  // Summed: (f1 - T) + (f2 - T) < 0 there as well.
  scene.surface.mode = ThresholdMode::kSummed;
  EXPECT_EQ(renderer->Render(scene, camera, {}).color[middle].a, 0.0f);
  scene.surface.mode = ThresholdMode::kBlended;
  EXPECT_EQ(renderer->Render(scene, camera, {}).color[middle].a, 1.0f);
}

TEST(ThresholdModes, BlendedRefusesNegativeDensities) {
  Scene scene = testing::SceneOf(testing::OneMetaball());
  scene.surface.mode = ThresholdMode::kBlended;
  scene.surface.density = ParseDensity("trigonometric:7,1");
  EXPECT_THROW(MakeCpuRenderer()->Render(scene, testing::FrontCamera(), {}), Error);
  scene.surface.density = ParseDensity("trigonometric:1.5,1");  // one lobe: nowhere negative
  EXPECT_NO_THROW(MakeCpuRenderer()->Render(scene, testing::FrontCamera(), {}));
}

TEST(SmallOnLarge, DoublesCarryRadiiOverSixOrdersOfMagnitude) {
  // Small metaballs standing on the surface of large ones; floats cannot place them.
  for (const double ratio : {1e-2, 1e-3, 1e-4, 1e-6}) {
    CloudInput input;
    input.center = {{0, 0, 0}};
    input.radius = {1.0};
    const double surface = std::sqrt(1 - std::sqrt(0.7));
    for (int i = -8; i <= 8; ++i) {
      for (int j = -8; j <= 8; ++j) {
        const double x = i * 0.8 * ratio, y = j * 0.8 * ratio;
        const double z = -std::sqrt(surface * surface - x * x - y * y);
        input.center.push_back({x, y, z - 0.1 * ratio});
        input.radius.push_back(ratio);
      }
    }
    const Scene scene = testing::SceneOf(input);
    const Camera camera = Camera::LookAt({2 * ratio, 3 * ratio, -surface - 12 * ratio},
                                         {0, 0, -surface}, {0, 1, 0}, 1.0, 96, 64);
    for (const CpuPath path : {CpuPath::kScalar, CpuPath::kBest}) {
      RenderSettings settings;
      settings.planes = {true, true, true};
      const Frame frame = MakeCpuRenderer(path)->Render(scene, camera, settings);
      const FrameDifference d =
          CompareToReference(frame, ReferenceRender(scene, camera), scene.cloud->frame.unit);
      EXPECT_EQ(d.missed + d.invented + d.color_off, 0u) << ratio << ": " << d.Describe();
      EXPECT_LE(d.depth_max, 1e-4) << ratio << ": " << d.Describe();
      EXPECT_LE(d.normal_max_deg, 0.1) << ratio << ": " << d.Describe();
    }
  }
}

}  // namespace
}  // namespace sherd
