// The thesis's renderer: that it draws the picture, and that it has the faults it is kept for. The
// tests of the second kind document what the default method does not have.
#include "metaball/thesis/thesis_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/cpu_renderer.h"
#include "metaball/error.h"
#include "metaball/frame_difference.h"
#include "metaball/local_view.h"
#include "test_scenes.h"

namespace sherd {
namespace {

using testing::RenderPlanes;

Frame RenderThesis(const Scene& scene, const Camera& camera, const ThesisOptions& options = {}) {
  return RenderPlanes(MakeThesisRenderer(options).get(), scene, camera);
}

// The share of the reference's pixels that a frame draws elsewhere: missed, invented, or off in
// depth by more than a tenth of the smallest radius.
double WrongShare(const Frame& frame, const ReferenceFrame& reference, const Scene& scene) {
  double wrong = 0, drawn = 0;
  for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
    const ReferenceHit& expected = reference.pixels[i];
    const bool hit = frame.id[i] >= 0;
    if (!expected.hit && !hit) continue;
    ++drawn;
    const double depth = static_cast<double>(frame.depth[i]) / scene.cloud->frame.unit;
    if (hit != expected.hit || std::abs(depth - expected.depth) > 0.1 * expected.smallest_radius) {
      ++wrong;
    }
  }
  return drawn > 0 ? wrong / drawn : 0;
}

// A metaball in one corner of a large octree, another in the opposite one: each is alone in its
// nodes. Radii a little below a node's side at that depth.
Scene TwoAlone(int depth, double threshold) {
  CloudInput input;
  input.center = {{-1, -1, -1}, {1, 1, 1}};
  const double side = 2.0 / (1 << depth);
  input.radius = {0.9 * side, 0.7 * side};
  return testing::SceneOf(input, threshold);
}

TEST(ThesisRenderer, ALoneMetaballIsDrawnRightAtEveryDepth) {
  for (int depth = 2; depth <= 10; ++depth) {
    const Scene scene = TwoAlone(depth, 0.3);
    const double r = 0.9 * 2.0 / (1 << depth);
    // Through the whole octree to the far corner, and right in front of it along an axis.
    const Camera cameras[] = {
        Camera::LookAt({1.9, 1.7, 1.8}, {-1, -1, -1}, {0, 1, 0}, 0.4 * r, 48, 48),
        Camera::LookAtOrthographic({-1, -1, -1 - 3 * r}, {-1, -1, -1}, {0, 1, 0}, 2 * r, 48, 48)};
    for (const Camera& camera : cameras) {
      const Frame frame = RenderThesis(scene, camera, {.depth = depth});
      const FrameDifference d =
          CompareToReference(frame, ReferenceRender(scene, camera), scene.cloud->frame.unit);
      EXPECT_GT(frame.stats.hits, 100u) << depth;
      EXPECT_LT(frame.stats.hits, 48u * 48) << depth;
      EXPECT_EQ(d.missed + d.invented, 0u) << "depth " << depth << ": " << d.Describe();
      // Solved directly: as exact as the doubles and floats that went in.
      EXPECT_LE(d.depth_max, 1e-5) << "depth " << depth << ": " << d.Describe();
      EXPECT_LE(d.normal_max_deg, 0.01) << d.Describe();
    }
  }
}

TEST(ThesisRenderer, DrawsEveryDensity) {
  for (const DensityModel& density : AllDensities()) {
    Scene scene = TwoAlone(3, 0.3 * PeakOf(density));
    if (density.kind == DensityKind::kReciprocal) scene.surface.threshold = 1.0;
    scene.surface.density = density;
    const Camera camera = Camera::LookAt({-1, -1, -2}, {-1, -1, -1}, {0, 1, 0}, 0.5, 48, 48);
    const Frame frame = RenderThesis(scene, camera, {.depth = 3});
    const FrameDifference d =
        CompareToReference(frame, ReferenceRender(scene, camera), scene.cloud->frame.unit);
    EXPECT_GT(frame.stats.hits, 50u) << TextOf(density);
    EXPECT_EQ(d.missed + d.invented, 0u) << TextOf(density) << ": " << d.Describe();
    EXPECT_LE(d.depth_max, 1e-4) << TextOf(density) << ": " << d.Describe();
  }
}

// The sizes of the sphere a lone metaball is drawn as, by the highest row it reaches.
double DrawnRadius(const Scene& scene, const Vec3d& center, const ThesisOptions& options) {
  const Camera camera =
      Camera::LookAtOrthographic(center - Vec3d{0, 0, 0.5}, center, {0, 1, 0}, 0.4, 201, 201);
  const Frame frame = RenderThesis(scene, camera, options);
  int drawn = 0;
  for (int x = 0; x < 201; ++x) drawn += frame.id[100 * 201 + x] >= 0 ? 1 : 0;
  return 0.5 * drawn * 0.4 / 201;
}

TEST(ThesisRenderer, ThresholdsOfTheCloudCountExceptInUniformMode) {
  CloudInput input;
  input.center = {{-1, -1, -1}, {1, 1, 1}};
  input.radius = {0.2, 0.2};
  input.threshold = {0.1, 0.8};
  Scene scene = testing::SceneOf(input, 0.5);
  const auto radius = [](double threshold) { return 0.2 * std::sqrt(1 - std::sqrt(threshold)); };
  const double pixel = 0.4 / 201;
  for (const bool gated : {true, false}) {
    const ThesisOptions options{.depth = 3, .gated = gated};
    for (const ThresholdMode mode :
         {ThresholdMode::kBlended, ThresholdMode::kSummed, ThresholdMode::kGated}) {
      scene.surface.mode = mode;
      EXPECT_NEAR(DrawnRadius(scene, {-1, -1, -1}, options), radius(0.1), pixel);
      EXPECT_NEAR(DrawnRadius(scene, {1, 1, 1}, options), radius(0.8), pixel);
    }
    scene.surface.mode = ThresholdMode::kUniform;
    EXPECT_NEAR(DrawnRadius(scene, {-1, -1, -1}, options), radius(0.5), pixel);
    EXPECT_NEAR(DrawnRadius(scene, {1, 1, 1}, options), radius(0.5), pixel);
  }
}

TEST(ThesisRenderer, TwoTogetherFollowTheModeWhenNotGated) {
  // One octree node holds both, so nothing of the octree's faults interferes.
  CloudInput input;
  input.center = {{-0.15, 0, 0}, {0.15, 0, 0}};
  input.radius = {0.4, 0.4};
  input.threshold = {0.6, 0.6};
  Scene scene = testing::SceneOf(input, 0.6);
  const Camera camera = Camera::LookAtOrthographic({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 0.6, 61, 61);
  const auto middle_depth = [&](ThresholdMode mode, bool gated) {
    scene.surface.mode = mode;
    const Frame frame = RenderThesis(scene, camera, {.depth = 1, .gated = gated});
    return static_cast<double>(frame.depth[30 * 61 + 30]);
  };
  const auto at = [](double x) { return 3 - 0.4 * std::sqrt(x - 0.140625); };
  // In the middle both are 0.15 off the axis: f = (1 - x^2)^2 each, x^2 = 0.140625 + (z / 0.4)^2.
  EXPECT_NEAR(middle_depth(ThresholdMode::kUniform, false), at(1 - std::sqrt(0.3)), 1e-4);
  EXPECT_NEAR(middle_depth(ThresholdMode::kBlended, false), at(1 - std::sqrt(0.3)), 1e-4);
  EXPECT_NEAR(middle_depth(ThresholdMode::kSummed, false), at(1 - std::sqrt(0.6)), 1e-4);
  EXPECT_NEAR(middle_depth(ThresholdMode::kGated, false), at(1 - std::sqrt(0.6)), 1e-4);
  EXPECT_NEAR(middle_depth(ThresholdMode::kUniform, true), at(1 - std::sqrt(0.6)), 1e-4);
}

TEST(ThesisRenderer, DrawsTheBigPicture) {
  for (const PeerScene& peer : {MakeHeightField(5000, 160, 90), MakeShell(5000, 160, 90)}) {
    const ReferenceFrame reference = ReferenceRender(peer.scene, peer.camera);
    const FrameDifference d =
        CompareToReference(RenderThesis(peer.scene, peer.camera, {.depth = 6}), reference,
                           peer.scene.cloud->frame.unit);
    const double pixels = static_cast<double>(d.pixels);
    EXPECT_LT(static_cast<double>(d.missed) / pixels, 0.06) << d.Describe();
    EXPECT_LT(static_cast<double>(d.invented) / pixels, 0.005) << d.Describe();
    EXPECT_LT(d.depth_median, 1.0) << d.Describe();
  }
}

// The gate makes a union of spheres: at every hit some metaball alone has just reached its
// threshold, although the field is far above it.
TEST(ThesisFaults, TheGateDrawsSpheres) {
  const PeerScene peer = MakeShell(2000, 96, 54);
  const Scene& scene = peer.scene;
  const Frame frame = RenderThesis(scene, peer.camera, {.depth = 5});
  const Camera local = LocalCamera(peer.camera, scene.cloud->frame);
  const double r = scene.cloud->uniform_radius, threshold = scene.surface.threshold;
  int hits = 0, above = 0;
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    if (frame.id[i] < 0) continue;
    ++hits;
    const RayD ray = RayThrough(local, i % 96 + 0.5, static_cast<double>(i / 96) + 0.5);
    const Vec3d p = ray.origin + ray.direction * (frame.depth[i] / scene.cloud->frame.unit);
    double nearest = 1;
    for (const Vec3f& center : scene.cloud->center) {
      const Vec3d offset = p - center.cast<double>();
      const double q = 1 - Dot(offset, offset) / (r * r);
      if (q > 0) nearest = std::min(nearest, std::abs(q * q - threshold));
    }
    ASSERT_LT(nearest, 1e-3);
    above += ReferenceField(scene, p) > 1.5 * threshold ? 1 : 0;
  }
  EXPECT_GT(hits, 1000);
  EXPECT_GT(above, hits / 2);
}

// Without the gate, and with nodes larger than any radius, what is left is the search that ends in
// the wrong node: small spheres and surfaces further back. The default has none of it.
TEST(ThesisFaults, TheSearchEndsInTheWrongNode) {
  const PeerScene peer = MakeHeightField(5000, 160, 90);
  const ReferenceFrame reference = ReferenceRender(peer.scene, peer.camera);
  const double r = peer.scene.cloud->uniform_radius;
  const int depth = 4;
  EXPECT_LT(r, 2.0 / (1 << depth));
  const Frame thesis =
      RenderThesis(peer.scene, peer.camera, {.depth = depth, .gated = false, .step = 0.02});
  const Frame ours = RenderPlanes(MakeCpuRenderer().get(), peer.scene, peer.camera);
  EXPECT_GT(WrongShare(thesis, reference, peer.scene), 0.01);
  EXPECT_EQ(WrongShare(ours, reference, peer.scene), 0.0);
}

// Nodes smaller than the radius lose what reaches into them from further away.
TEST(ThesisFaults, SmallNodesAreWorse) {
  const PeerScene peer = MakeHeightField(5000, 160, 90);
  const ReferenceFrame reference = ReferenceRender(peer.scene, peer.camera);
  double before = 0;
  for (const int depth : {4, 6, 8}) {
    const double wrong =
        WrongShare(RenderThesis(peer.scene, peer.camera, {.depth = depth, .gated = false}),
                   reference, peer.scene);
    EXPECT_GT(wrong, before) << depth;
    before = wrong;
  }
  EXPECT_GT(before, 0.5);
}

TEST(ThesisFaults, LargeMetaballsAreLostInSmallNodes) {
  const Scene scene = testing::SceneOf(testing::OneMetaball(), 0.3);
  const Camera camera = testing::FrontCamera();
  const std::uint64_t whole = RenderThesis(scene, camera, {.depth = 1}).stats.hits;
  EXPECT_GT(whole, 200u);
  std::uint64_t before = whole;
  for (const int depth : {3, 5}) {
    const std::uint64_t hits = RenderThesis(scene, camera, {.depth = depth}).stats.hits;
    EXPECT_LT(hits, before / 2) << depth;
    before = hits;
  }
}

TEST(ThesisFaults, TheGatedPictureIsRoughAllOver) {
  const PeerScene peer = MakeHeightField(5000, 160, 90);
  const ReferenceFrame reference = ReferenceRender(peer.scene, peer.camera);
  EXPECT_GT(WrongShare(RenderThesis(peer.scene, peer.camera, {.depth = 6}), reference, peer.scene),
            0.5);
}

TEST(ThesisRenderer, RaysThatStartInside) {
  const Scene scene = TwoAlone(2, 0.3);
  const Camera camera = Camera::LookAt({-1.01, -1, -1}, {-2, -1, -1}, {0, 1, 0}, 1.0, 16, 16);
  const Frame frame = RenderThesis(scene, camera, {.depth = 2});
  EXPECT_EQ(frame.stats.rays_started_inside, 256u);
  EXPECT_EQ(frame.stats.hits, 256u);
  for (const float depth : frame.depth) {
    ASSERT_GT(depth, 0.0f);  // 0 would mean that nothing is hit
    ASSERT_LT(depth, 1e-6f);
  }
}

TEST(ThesisRenderer, KeepsTheRenderersPromises) {
  auto renderer = MakeThesisRenderer({.depth = 4});
  const Scene scene = testing::SceneOf(testing::RandomBall(500, 0.15, 2, 3));
  const Camera camera = testing::FrontCamera(64, 48);
  const Frame one = RenderPlanes(renderer.get(), scene, camera, 1, 1);
  EXPECT_GT(one.stats.hits, 300u);
  EXPECT_EQ(one.stats.rays, 64u * 48);
  EXPECT_EQ(one.stats.metaballs, 500u);
  EXPECT_GT(one.stats.bytes, 0u);
  EXPECT_GT(one.stats.seconds_trace, 0.0);
  EXPECT_EQ(one.stats.backend, "cpu");
  const Frame two = RenderPlanes(renderer.get(), scene, camera, 1, 2);
  EXPECT_EQ(one.depth, two.depth);
  EXPECT_EQ(one.id, two.id);

  const Frame fine = RenderPlanes(renderer.get(), scene, camera.Resized(128, 96));
  const Frame averaged = RenderPlanes(renderer.get(), scene, camera, 2);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      float sum = 0;
      for (const int k : {0, 1, 128, 129}) {
        sum += fine.color[static_cast<std::size_t>(2 * y) * 128 + 2 * x + k].g;
      }
      ASSERT_NEAR(averaged.color[static_cast<std::size_t>(y) * 64 + x].g, sum / 4, 1e-6);
    }
  }

  EXPECT_TRUE(renderer->Render(scene, camera, {}).depth.empty());
  EXPECT_EQ(RenderPlanes(renderer.get(), testing::SceneOf({}), camera).stats.hits, 0u);
  // Another radius after the same cloud: the octree is built anew.
  Scene wide = scene;
  wide.surface.radius_scale = 1.5;
  EXPECT_GT(RenderPlanes(renderer.get(), wide, camera).stats.hits, one.stats.hits);
  EXPECT_EQ(RenderPlanes(renderer.get(), scene, camera).depth, one.depth);

  std::stop_source stop;
  stop.request_stop();
  Control control;
  control.stop = stop.get_token();
  EXPECT_THROW(renderer->Render(scene, camera, {}, control), Cancelled);
  EXPECT_EQ(RenderPlanes(renderer.get(), scene, camera).depth, one.depth);
}

TEST(ThesisRenderer, RefusesOptionsOutOfRange) {
  EXPECT_THROW(MakeThesisRenderer({.depth = 0}), Error);
  EXPECT_THROW(MakeThesisRenderer({.depth = 11}), Error);
  EXPECT_THROW(MakeThesisRenderer({.step = 0}), Error);
  EXPECT_THROW(MakeThesisRenderer({.tolerance = -1}), Error);
}

}  // namespace
}  // namespace sherd
