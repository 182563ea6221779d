// The rival methods against the double-precision reference: what each guarantees holds, and where
// each is said to fail it does.
#include "metaball/methods/methods.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"
#include "metaball/frame_difference.h"
#include "metaball/thesis/thesis_renderer.h"
#include "test_scenes.h"

namespace sherd {
namespace {

using testing::RenderPlanes;

Frame RenderBy(Method method, const Scene& scene, const Camera& camera,
               const MethodOptions& options = {}) {
  return RenderPlanes(MakeMethodRenderer(method, options).get(), scene, camera);
}

FrameDifference Compare(const Frame& frame, const Scene& scene, const Camera& camera) {
  return CompareToReference(frame, ReferenceRender(scene, camera), scene.cloud->frame.unit);
}

// Not in `a`'s sense wrong, but in front of or behind the reference by more than `radii`.
struct DepthSides {
  int in_front = 0, behind = 0;
};
DepthSides SidesOf(const Frame& frame, const Scene& scene, const Camera& camera, double radii) {
  const ReferenceFrame reference = ReferenceRender(scene, camera);
  DepthSides sides;
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    const ReferenceHit& expected = reference.pixels[i];
    if (!expected.hit || expected.grazing || frame.id[i] < 0) continue;
    const double depth = static_cast<double>(frame.depth[i]) / scene.cloud->frame.unit;
    // Half a step of the plane's floats is the plane's.
    const double slack = radii * expected.smallest_radius + 6e-8 * depth;
    sides.in_front += depth < expected.depth - slack ? 1 : 0;
    sides.behind += depth > expected.depth + slack ? 1 : 0;
  }
  return sides;
}

// A threshold that one metaball alone can reach.
double LowThresholdFor(const DensityModel& density) {
  return density.kind == DensityKind::kReciprocal ? 1.0 : 0.3 * PeakOf(density);
}

constexpr ThresholdMode kOwnThresholds[] = {ThresholdMode::kBlended, ThresholdMode::kSummed,
                                            ThresholdMode::kGated};

bool IsPolynomial(const DensityModel& density) {
  return density.kind == DensityKind::kMurakami || density.kind == DensityKind::kPower ||
         density.kind == DensityKind::kWyvill ||
         (density.kind == DensityKind::kRamp && (density.degree == 2 || density.degree == 4));
}

// Calls f(scene, text) for every density with every way to use the metaballs' own thresholds.
template <class F>
void ForEveryOwnThresholdsScene(const F& f) {
  for (const ThresholdMode mode : kOwnThresholds) {
    testing::ForEveryDensity(mode, [&](const DensityModel& density) {
      const double threshold = testing::ThresholdFor(density, mode);
      Scene scene =
          testing::SceneOf(testing::BallWithThresholds(200, 0.35, 3, 7, threshold), threshold);
      scene.surface.density = density;
      scene.surface.mode = mode;
      f(scene, NameOf(mode) + " " + TextOf(density));
    });
  }
}

// Thin parts: metaballs that only just reach the threshold, seen edge on.
Scene ThinScene() {
  Scene scene = testing::SceneOf(testing::RandomBall(300, 0.25, 4, 31));
  scene.surface.threshold = 0.9;
  return scene;
}

struct Certified {
  Method method;
  bool single_precision;
};

class CertifiedTest : public ::testing::TestWithParam<Certified> {
 protected:
  MethodOptions Options() const { return {.single_precision = GetParam().single_precision}; }

  void ExpectAgrees(const Scene& scene, const Camera& camera, const std::string& what) {
    const Frame frame = RenderBy(GetParam().method, scene, camera, Options());
    const FrameDifference d = Compare(frame, scene, camera);
    EXPECT_EQ(d.missed, 0u) << what << ": " << d.Describe();
    EXPECT_EQ(d.invented, 0u) << what << ": " << d.Describe();
    EXPECT_EQ(d.color_off, 0u) << what << ": " << d.Describe();
    EXPECT_LE(d.depth_max, 1e-4) << what << ": " << d.Describe();
    EXPECT_EQ(frame.stats.unresolved, 0u) << what;
    EXPECT_GT(frame.stats.hits, 0u) << what;
  }
};

TEST_P(CertifiedTest, HeightFieldAndShell) {
  for (const PeerScene& peer : {MakeHeightField(2000, 160, 90), MakeShell(2000, 160, 90)}) {
    ExpectAgrees(peer.scene, peer.camera, "peer scene");
  }
}

TEST_P(CertifiedTest, RadiiOfManySizes) {
  for (const double spread : {1.0, 30.0, 1000.0}) {
    const Scene scene = testing::SceneOf(testing::RandomBall(1000, 0.25, spread, 2));
    const std::string what = "spread " + std::to_string(spread);
    ExpectAgrees(scene, testing::FrontCamera(80, 60), what);
    ExpectAgrees(scene, Camera::LookAtOrthographic({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 2.5, 60, 60),
                 what);
    ExpectAgrees(scene, Camera::LookAt({0.2, 0.1, 0}, {1, 0, 0}, {0, 1, 0}, 1.5, 60, 45), what);
  }
  ExpectAgrees(ThinScene(), testing::FrontCamera(80, 60), "thin");
}

TEST_P(CertifiedTest, EveryDensityItCanDraw) {
  for (const DensityModel& density : AllDensities()) {
    Scene scene = testing::SceneOf(testing::RandomBall(200, 0.35, 3, 4), LowThresholdFor(density));
    scene.surface.density = density;
    const Camera camera = testing::FrontCamera(64, 48);
    if (GetParam().method == Method::kPolynomial && !IsPolynomial(density)) {
      EXPECT_THROW(RenderBy(Method::kPolynomial, scene, camera), Error) << TextOf(density);
    } else {
      ExpectAgrees(scene, camera, TextOf(density));
    }
  }
}

TEST_P(CertifiedTest, EveryThresholdOfEveryDensityItCanDraw) {
  ForEveryOwnThresholdsScene([&](const Scene& scene, const std::string& what) {
    if (GetParam().method == Method::kPolynomial && !IsPolynomial(scene.surface.density)) return;
    const Camera camera = testing::FrontCamera(64, 48);
    // Summed thresholds jump where supports begin and end: the surface follows rims, on which
    // rounding says who belongs to the sums, and may last for less than any tolerance.
    if (scene.surface.mode != ThresholdMode::kSummed) return ExpectAgrees(scene, camera, what);
    const Frame frame = RenderBy(GetParam().method, scene, camera, Options());
    const FrameDifference d = Compare(frame, scene, camera);
    EXPECT_LE(d.missed + d.invented, d.pixels / 1000) << what << ": " << d.Describe();
    EXPECT_LE(d.depth_p99, 1e-4) << what << ": " << d.Describe();
    EXPECT_EQ(frame.stats.unresolved, 0u) << what;
    EXPECT_GT(frame.stats.hits, 100u) << what;
  });
}

TEST_P(CertifiedTest, BlendedHeightFieldAndShell) {
  for (PeerScene peer : {MakeHeightField(2000, 160, 90), MakeShell(2000, 160, 90)}) {
    auto cloud = std::make_shared<Cloud>(*peer.scene.cloud);
    SpreadThresholds(peer.scene.surface.threshold, 0.3, cloud.get());
    peer.scene.cloud = cloud;
    peer.scene.surface.mode = ThresholdMode::kBlended;
    ExpectAgrees(peer.scene, peer.camera, "blended peer scene");
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, CertifiedTest,
                         ::testing::Values(Certified{Method::kInterval, false},
                                           Certified{Method::kInterval, true},
                                           Certified{Method::kPolynomial, false}),
                         [](const auto& param_info) {
                           return param_info.param.method == Method::kPolynomial ? "Polynomial"
                                  : param_info.param.single_precision ? "IntervalInFloats"
                                                                      : "Interval";
                         });

// Where nothing overlaps a polynomial's root is known: the place is far better than the tolerance.
TEST(Polynomial, IsAsExactAsTheDoublesThatGoIn) {
  for (const int degree : {1, 2, 16}) {
    Scene scene = testing::SceneOf(testing::OneMetaball(), 0.01);
    scene.surface.density = {DensityKind::kPower, degree};
    const Camera camera = Camera::LookAtOrthographic({0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 1.0, 33, 33);
    const Frame frame = RenderBy(Method::kPolynomial, scene, camera, {.tolerance = 1.0});
    const double radius2 = 1 - std::pow(0.01, 1.0 / degree);
    for (int x = 0; x < 33; ++x) {
      const double off = (x + 0.5) / 33 - 0.5;
      if (off * off > radius2 - 1e-6) continue;
      ASSERT_NEAR(frame.depth[16 * 33 + x], 4 - std::sqrt(radius2 - off * off), 4e-7) << degree;
    }
  }
}

TEST(SphereTracing, MissesNothingAndStopsInFront) {
  for (const DensityModel& density : AllDensities()) {
    Scene scene = testing::SceneOf(testing::RandomBall(200, 0.35, 3, 5), LowThresholdFor(density));
    scene.surface.density = density;
    const Camera camera = testing::FrontCamera(64, 48);
    const MethodOptions options{.tolerance = 1e-3};
    if (density.kind == DensityKind::kReciprocal) {  // every step would lie within the tolerance
      EXPECT_THROW(RenderBy(Method::kSphereTracing, scene, camera, options), Error);
      continue;
    }
    const Frame frame = RenderBy(Method::kSphereTracing, scene, camera, options);
    const FrameDifference d = Compare(frame, scene, camera);
    EXPECT_EQ(d.missed, 0u) << TextOf(density) << ": " << d.Describe();
    EXPECT_EQ(SidesOf(frame, scene, camera, 1e-9).behind, 0) << TextOf(density);
    EXPECT_LT(static_cast<double>(d.invented), 0.02 * static_cast<double>(d.pixels))
        << TextOf(density) << ": " << d.Describe();
    EXPECT_LT(d.depth_median, 0.05) << TextOf(density) << ": " << d.Describe();
  }
}

TEST(SphereTracing, MissesNothingWhateverTheThresholds) {
  ForEveryOwnThresholdsScene([&](const Scene& scene, const std::string& what) {
    const Camera camera = testing::FrontCamera(64, 48);
    const MethodOptions options{.tolerance = 1e-3};
    if (scene.surface.density.kind == DensityKind::kReciprocal) {
      EXPECT_THROW(RenderBy(Method::kSphereTracing, scene, camera, options), Error);
      return;
    }
    const Frame frame = RenderBy(Method::kSphereTracing, scene, camera, options);
    const FrameDifference d = Compare(frame, scene, camera);
    EXPECT_EQ(d.missed, 0u) << what << ": " << d.Describe();
    EXPECT_EQ(SidesOf(frame, scene, camera, 1e-9).behind, 0) << what;
    EXPECT_LT(static_cast<double>(d.invented), 0.02 * static_cast<double>(d.pixels))
        << what << ": " << d.Describe();
    EXPECT_LT(d.depth_median, 0.05) << what << ": " << d.Describe();
  });
}

// Small metaballs behind the beginning of a large one: its own bound alone would allow a step over
// them.
TEST(SphereTracing, LooksNoFurtherThanItsBoundDoes) {
  Scene scene = testing::SceneOf(testing::RandomBall(600, 0.5, 100, 8), 0.9);
  scene.surface.density.kind = DensityKind::kRatio;
  const Camera camera = testing::FrontCamera(80, 60);
  const FrameDifference d =
      Compare(RenderBy(Method::kSphereTracing, scene, camera, {.tolerance = 1e-3}), scene, camera);
  EXPECT_EQ(d.missed, 0u) << d.Describe();
  EXPECT_LT(d.depth_p99, 0.1) << d.Describe();
}

TEST(SphereTracing, InventsRimsWhichASmallerToleranceNarrows) {
  const Scene scene = ThinScene();
  const Camera camera = testing::FrontCamera(160, 120);
  std::uint64_t before = ~0ull;
  for (const double tolerance : {0.1, 0.01, 0.001}) {
    const FrameDifference d = Compare(
        RenderBy(Method::kSphereTracing, scene, camera, {.tolerance = tolerance}), scene, camera);
    EXPECT_LT(d.invented, before) << tolerance;
    before = d.invented;
    if (tolerance == 0.01) {
      EXPECT_GT(d.invented, 20u) << d.Describe();
    }
  }
}

class MarchTest : public ::testing::TestWithParam<Method> {};

TEST_P(MarchTest, InventsNothingAndStopsBehind) {
  for (const DensityModel& density : AllDensities()) {
    Scene scene = testing::SceneOf(testing::RandomBall(200, 0.35, 3, 6), LowThresholdFor(density));
    scene.surface.density = density;
    const Camera camera = testing::FrontCamera(64, 48);
    const Frame frame = RenderBy(GetParam(), scene, camera, {.step = 0.05});
    const FrameDifference d = Compare(frame, scene, camera);
    EXPECT_EQ(d.invented, 0u) << TextOf(density) << ": " << d.Describe();
    EXPECT_EQ(SidesOf(frame, scene, camera, 1e-9).in_front, 0) << TextOf(density);
    EXPECT_LT(static_cast<double>(d.missed), 0.02 * static_cast<double>(d.pixels))
        << TextOf(density) << ": " << d.Describe();
    EXPECT_LE(d.depth_median, 1e-4) << TextOf(density) << ": " << d.Describe();
  }
}

TEST_P(MarchTest, InventsNothingWhateverTheThresholds) {
  ForEveryOwnThresholdsScene([&](const Scene& scene, const std::string& what) {
    const Camera camera = testing::FrontCamera(64, 48);
    const Frame frame = RenderBy(GetParam(), scene, camera, {.step = 0.05});
    const FrameDifference d = Compare(frame, scene, camera);
    EXPECT_EQ(d.invented, 0u) << what << ": " << d.Describe();
    EXPECT_EQ(SidesOf(frame, scene, camera, 1e-9).in_front, 0) << what;
    EXPECT_LT(static_cast<double>(d.missed), 0.02 * static_cast<double>(d.pixels))
        << what << ": " << d.Describe();
    EXPECT_LE(d.depth_median, 1e-4) << what << ": " << d.Describe();
  });
}

TEST_P(MarchTest, LongStepsLoseThinPartsAndPlaceOthersBehind) {
  const Scene scene = ThinScene();
  const Camera camera = testing::FrontCamera(160, 120);
  std::uint64_t before = ~0ull;
  for (const double step : {0.6, 0.3, 0.1, 0.02}) {
    const Frame frame = RenderBy(GetParam(), scene, camera, {.step = step});
    const FrameDifference d = Compare(frame, scene, camera);
    EXPECT_LT(d.missed, before) << step << ": " << d.Describe();
    before = d.missed;
    if (step == 0.3) {
      EXPECT_GT(d.missed, 20u) << d.Describe();
      EXPECT_GT(SidesOf(frame, scene, camera, 0.1).behind, 10);
    }
  }
}

TEST_P(MarchTest, DrawsTheBigPicture) {
  const PeerScene peer = MakeHeightField(2000, 160, 90);
  const FrameDifference d =
      Compare(RenderBy(GetParam(), peer.scene, peer.camera), peer.scene, peer.camera);
  EXPECT_LT(static_cast<double>(d.missed), 0.005 * static_cast<double>(d.pixels)) << d.Describe();
  EXPECT_LT(static_cast<double>(d.color_off), 0.005 * static_cast<double>(d.pixels))
      << d.Describe();
  EXPECT_LE(d.depth_p99, 1e-4) << d.Describe();
}

INSTANTIATE_TEST_SUITE_P(Methods, MarchTest,
                         ::testing::Values(Method::kFixedMarch, Method::kAdaptiveMarch),
                         [](const auto& param_info) {
                           return param_info.param == Method::kFixedMarch ? "Fixed" : "Adaptive";
                         });

class MethodTest : public ::testing::TestWithParam<Method> {};

TEST_P(MethodTest, KeepsTheRenderersPromises) {
  // A loose tolerance for sphere tracing's sake; depths then differ, promises do not.
  auto renderer = MakeMethodRenderer(GetParam(), {.tolerance = 1e-3, .thesis_depth = 4});
  const Scene scene = testing::SceneOf(testing::RandomBall(500, 0.15, 2, 3));
  const Camera camera = testing::FrontCamera(64, 48);
  const Frame one = RenderPlanes(renderer.get(), scene, camera, 1, 1);
  EXPECT_GT(one.stats.hits, 300u);
  EXPECT_EQ(one.stats.rays, 64u * 48);
  EXPECT_EQ(one.stats.metaballs, 500u);
  EXPECT_EQ(one.stats.backend, "cpu");
  EXPECT_EQ(one.stats.unresolved, 0u);
  EXPECT_FALSE(renderer->device().empty());
  std::uint64_t hits = 0;
  for (std::size_t i = 0; i < one.id.size(); ++i) {
    hits += one.id[i] >= 0 ? 1 : 0;
    ASSERT_EQ(one.id[i] >= 0, one.depth[i] > 0);
    ASSERT_EQ(one.id[i] >= 0, one.color[i].a == 1.0f);
    if (one.id[i] >= 0) {
      ASSERT_NEAR(Length(one.normal[i]), 1.0f, 1e-5);
    }
  }
  EXPECT_EQ(hits, one.stats.hits);
  const Frame two = RenderPlanes(renderer.get(), scene, camera, 1, 2);
  EXPECT_EQ(one.depth, two.depth);
  EXPECT_EQ(one.id, two.id);

  const Frame averaged = RenderPlanes(renderer.get(), scene, camera, 2);
  EXPECT_EQ(averaged.width, 64);
  EXPECT_EQ(averaged.stats.rays, 4 * 64u * 48);
  EXPECT_TRUE(renderer->Render(scene, camera, {}).depth.empty());
  EXPECT_EQ(RenderPlanes(renderer.get(), testing::SceneOf({}), camera).stats.hits, 0u);

  std::stop_source stop;
  stop.request_stop();
  Control control;
  control.stop = stop.get_token();
  EXPECT_THROW(renderer->Render(scene, camera, {}, control), Cancelled);
  EXPECT_EQ(RenderPlanes(renderer.get(), scene, camera).depth, one.depth);
}

TEST_P(MethodTest, RaysThatStartInsideSaySo) {
  const Scene scene = testing::SceneOf(testing::OneMetaball());
  const Camera camera = Camera::LookAt({0.01, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1.0, 16, 16);
  const Frame frame = RenderBy(GetParam(), scene, camera, {.thesis_depth = 1});
  EXPECT_EQ(frame.stats.rays_started_inside, 256u);
  EXPECT_EQ(frame.stats.hits, 256u);
  for (const float depth : frame.depth) {
    ASSERT_GT(depth, 0.0f);
    ASSERT_LT(depth, 1e-6f);
  }
}

TEST_P(MethodTest, NothingIsDrawnAboveTheHighestField) {
  const Scene scene = testing::SceneOf(testing::OneMetaball(), 1.1);
  EXPECT_EQ(RenderBy(GetParam(), scene, testing::FrontCamera(), {.thesis_depth = 1}).stats.hits,
            0u);
}

// Scenes that would make a careless loop endless or divide by nothing.
TEST_P(MethodTest, ExtremeScenesEnd) {
  const MethodOptions options{.tolerance = 1e-3, .thesis_depth = 2};
  CloudInput same = testing::OneMetaball({0, 0, 0}, 0.9);
  same.center.assign(300, {0.1, 0.1, 0.1});
  same.radius.assign(300, 0.9);
  CloudInput wide = testing::RandomBall(300, 0.5, 1e6, 9);
  CloudInput huge = testing::RandomBall(50, 0.3, 2, 10);
  huge.radius[7] = 1e25;
  for (const CloudInput& input : {same, wide, huge}) {
    const Scene scene = testing::SceneOf(input, 0.6);
    for (const double distance : {0.0, 3.0, 1e6}) {
      const double fov = distance > 10 ? 2.5 / distance : 1.0;
      const Camera camera = Camera::LookAt({0, 0, -distance}, {0, 0, 0.01}, {0, 1, 0}, fov, 24, 16);
      const Frame frame = RenderBy(GetParam(), scene, camera, options);
      EXPECT_GT(frame.stats.hits, 0u);
      EXPECT_EQ(frame.stats.unresolved, 0u) << distance;
    }
  }
}

TEST_P(MethodTest, NameAndTextAreInverse) {
  EXPECT_EQ(ParseMethod(NameOf(GetParam())), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Methods, MethodTest, ::testing::ValuesIn(AllMethods()),
                         [](const auto& param_info) {
                           std::string name(NameOf(param_info.param));
                           std::erase(name, '-');
                           return name;
                         });

TEST(Methods, RefuseWhatTheyCannotDo) {
  EXPECT_THROW(ParseMethod("magic"), InputError);
  EXPECT_THROW(MakeMethodRenderer(Method::kFixedMarch, {.step = 0}), Error);
  EXPECT_THROW(MakeMethodRenderer(Method::kInterval, {.tolerance = NAN}), Error);
  EXPECT_THROW(MakeMethodRenderer(Method::kThesis, {.thesis_depth = 11}), Error);
  Scene scene = testing::SceneOf(testing::OneMetaball());
  scene.surface.mode = ThresholdMode::kBlended;
  scene.surface.density = ParseDensity("trigonometric:7,1");
  for (const Method method : AllMethods()) {
    EXPECT_THROW(RenderBy(method, scene, testing::FrontCamera()), Error) << NameOf(method);
  }
}

TEST(Methods, DrawAnAppearanceOrSayThatTheyCannot) {
  PeerScene peer = MakeHeightField(2500, 96, 54);
  const auto method = MakeMethodRenderer(Method::kFixedMarch, {});
  const auto thesis = MakeThesisRenderer();
  for (Renderer* renderer : {method.get(), thesis.get()}) {
    Scene scene = peer.scene;
    const Frame plain = renderer->Render(scene, peer.camera, {});
    scene.appearance.lights = {Light{.kind = LightKind::kDirectional, .to_light = {1, 0.2, 0.3}}};
    scene.appearance.shadows.enabled = true;
    const Frame lit = renderer->Render(scene, peer.camera, {});
    std::size_t changed = 0;
    for (std::size_t i = 0; i < lit.color.size(); ++i) {
      changed += std::abs(lit.color[i].g - plain.color[i].g) > 0.05f;
    }
    EXPECT_GT(changed, 500u);
    scene.appearance = {};
    scene.appearance.color = ColorSource::kQuantity;  // needs a plane that these do not sum up
    EXPECT_THROW(renderer->Render(scene, peer.camera, {}), Error);
  }
}

}  // namespace
}  // namespace sherd
