#include "metaball/level_of_detail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/reference/reference.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

// One pixel a world unit: an error in pixels is the error in world units.
Camera UnitCamera() {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.width = camera.height = 1;
  return camera;
}

// All levels there are, each with its cloud.
void MakeAll(LevelsOfDetail* levels) {
  const double everything = std::numeric_limits<double>::max();
  levels->For(UnitCamera(), everything);
  for (std::size_t k = 0; k < levels->levels().size(); ++k) {
    levels->For(UnitCamera(), std::nextafter(levels->levels()[k].error, everything));
  }
}

Scene WithCloud(const Scene& scene, std::shared_ptr<const Cloud> cloud) {
  Scene other = scene;
  other.cloud = std::move(cloud);
  return other;
}

// The pixels of `a` around which, as far as `reach_px` goes, `b` is nowhere hit less than
// `farther` (local units) behind the hit of `a`.
int CountUnmatched(const ReferenceFrame& a, const ReferenceFrame& b, double reach_px,
                   double farther) {
  const int reach = static_cast<int>(std::ceil(reach_px));
  int unmatched = 0;
  for (int y = reach; y < a.height - reach; ++y) {
    for (int x = reach; x < a.width - reach; ++x) {
      const ReferenceHit& hit = a.pixels[static_cast<std::size_t>(y) * a.width + x];
      if (!hit.hit) continue;
      bool matched = false;
      for (int v = y - reach; v <= y + reach && !matched; ++v) {
        for (int u = x - reach; u <= x + reach && !matched; ++u) {
          if (std::hypot(u - x, v - y) > reach_px) continue;
          const ReferenceHit& other = b.pixels[static_cast<std::size_t>(v) * b.width + u];
          matched = other.hit && other.depth <= hit.depth + farther;
        }
      }
      unmatched += matched ? 0 : 1;
    }
  }
  return unmatched;
}

// What a level states, against the reference: both ways, for every pixel of both pictures.
void ExpectErrorHolds(const Scene& scene, const Camera& camera) {
  LevelsOfDetail levels(*scene.cloud, scene.surface);
  MakeAll(&levels);
  ASSERT_GE(levels.levels().size(), 2u);
  const double unit = scene.cloud->frame.unit;
  const ReferenceFrame full = ReferenceRender(scene, camera);
  int compared = 0;
  for (const LevelOfDetail& level : levels.levels()) {
    ASSERT_TRUE(level.cloud);
    EXPECT_EQ(level.cloud->size(), level.metaballs);
    level.cloud->Validate("level");
    const double error_px = level.error * camera.fx;
    if (error_px > 0.2 * camera.height) break;
    ++compared;
    const ReferenceFrame coarse = ReferenceRender(WithCloud(scene, level.cloud), camera);
    // Pixels are samples one apart: the nearest to a point is up to 0.71 away.
    const double farther = level.error / unit;
    EXPECT_EQ(CountUnmatched(full, coarse, error_px + 0.71, farther), 0) << level.metaballs;
    EXPECT_EQ(CountUnmatched(coarse, full, error_px + 0.71, farther), 0) << level.metaballs;
  }
  EXPECT_GE(compared, 1);
}

Camera OrthoCamera(const Vec3d& eye, double width) {
  return Camera::LookAtOrthographic(eye, {0.5, 0, 0.5}, {0, 1, 0}, width, 96, 96);
}

TEST(LevelOfDetail, KeepsItsErrorOnAHeightField) {
  ExpectErrorHolds(MakeHeightField(4900).scene, OrthoCamera({0.2, 1.0, -0.4}, 1.4));
}

TEST(LevelOfDetail, KeepsItsErrorOnAShell) {
  ExpectErrorHolds(MakeShell(5000).scene,
                   Camera::LookAtOrthographic({0.3, 0.5, -1.5}, {0, 0, 0}, {0, 1, 0}, 1.3, 96, 96));
}

TEST(LevelOfDetail, KeepsItsErrorForOtherDensities) {
  for (const char* density : {"wyvill", "blinn:4,2", "ramp:1,1", "nishimura"}) {
    Scene scene = MakeHeightField(2500).scene;
    scene.surface.density = ParseDensity(density);
    SCOPED_TRACE(density);
    ExpectErrorHolds(scene, OrthoCamera({0.2, 1.0, -0.4}, 1.4));
  }
}

TEST(LevelOfDetail, KeepsItsErrorForMixedRadii) {
  Scene scene = testing::SceneOf(testing::RandomBall(6000, 0.2, 20, 5));
  ExpectErrorHolds(scene,
                   Camera::LookAtOrthographic({0.3, 0.5, -4}, {0, 0, 0}, {0, 1, 0}, 2.6, 96, 96));
}

// Beyond what is proven: the surface of a sheet stays where it is.
TEST(LevelOfDetail, TheSurfaceOfASheetStaysInPlace) {
  const PeerScene peer = MakeHeightField(10000);
  LevelsOfDetail levels(*peer.scene.cloud, peer.scene.surface);
  MakeAll(&levels);
  const Camera camera = OrthoCamera({0.5, 1.5, 0.499}, 0.8);
  const ReferenceFrame full = ReferenceRender(peer.scene, camera);
  const double radius = peer.scene.cloud->uniform_radius;
  for (int k = 0; k < 2; ++k) {
    const LevelOfDetail& level = levels.levels()[static_cast<std::size_t>(k)];
    const ReferenceFrame coarse = ReferenceRender(WithCloud(peer.scene, level.cloud), camera);
    double sum = 0;
    std::vector<double> off;
    for (std::size_t i = 0; i < full.pixels.size(); ++i) {
      ASSERT_TRUE(full.pixels[i].hit);
      ASSERT_TRUE(coarse.pixels[i].hit) << "the level has a hole";
      const double d = (coarse.pixels[i].depth - full.pixels[i].depth) / radius;
      sum += d;
      off.push_back(std::abs(d));
    }
    std::sort(off.begin(), off.end());
    const double mean = sum / static_cast<double>(off.size());
    EXPECT_LT(std::abs(mean), 0.15 + 0.65 * k) << level.metaballs;
    EXPECT_LT(off[off.size() * 99 / 100], 0.5 + 0.9 * k) << level.metaballs;
  }
}

TEST(LevelOfDetail, NothingToMerge) {
  for (const CloudInput& input : {CloudInput{}, testing::OneMetaball()}) {
    const Cloud cloud = BuildCloud(input);
    LevelsOfDetail levels(cloud, Surface{});
    EXPECT_FALSE(levels.why_not().empty());
    EXPECT_EQ(levels.For(UnitCamera(), 1e9).level, nullptr);
  }
}

TEST(LevelOfDetail, SaysWhyASurfaceHasNone) {
  const Cloud cloud = BuildCloud(testing::RandomBall(100, 0.3, 1, 2));
  const auto why_not = [&](const Surface& surface) {
    return LevelsOfDetail(cloud, surface).why_not();
  };
  EXPECT_EQ(why_not({}), "");
  EXPECT_NE(why_not({.mode = ThresholdMode::kBlended}), "");
  EXPECT_NE(why_not({.mode = ThresholdMode::kGated}), "");
  EXPECT_NE(why_not({.threshold = 1.5}), "");
  EXPECT_NE(why_not({.density = ParseDensity("trigonometric:7.85,1")}), "");
}

TEST(LevelOfDetail, IdenticalCentres) {
  for (const int count : {2, 200, 5000}) {
    CloudInput input;
    input.center.assign(static_cast<std::size_t>(count), Vec3d{3, 4, 5});
    input.uniform_radius = 0.5;
    const Scene scene = testing::SceneOf(input);
    LevelsOfDetail levels(*scene.cloud, scene.surface);
    MakeAll(&levels);
    ASSERT_EQ(levels.levels().size(), 1u);
    const LevelOfDetail& level = levels.levels()[0];
    ASSERT_EQ(level.metaballs, 1u);
    const RayD ray{{0.013, -0.02, -50}, {0, 0, 1}};
    const ReferenceHit a = ReferenceTrace(scene, ray);
    const ReferenceHit b = ReferenceTrace(WithCloud(scene, level.cloud), ray);
    ASSERT_TRUE(a.hit && b.hit);
    EXPECT_LE(std::abs(a.depth - b.depth) * scene.cloud->frame.unit, level.error);
    EXPECT_LT(level.error, 2 * input.uniform_radius);
  }
}

TEST(LevelOfDetail, LargeMetaballsStayAsTheyAreAmongSmallOnes) {
  // Six orders of magnitude: one of radius 1 and, beside it, a plate of small ones.
  CloudInput input;
  for (int j = 0; j < 40; ++j) {
    for (int i = 0; i < 40; ++i) {
      input.center.push_back({2 + i * 1e-6, j * 1e-6, 0});
      input.radius.push_back(2.5e-6);
    }
  }
  input.center.push_back({0, 0, 0});
  input.radius.push_back(1.0);
  const Scene scene = testing::SceneOf(input);
  LevelsOfDetail levels(*scene.cloud, scene.surface);
  MakeAll(&levels);
  int fine = 0;
  for (const LevelOfDetail& level : levels.levels()) {
    if (level.error > 0.1) break;  // where the large one is small, too
    ++fine;
    const auto local = static_cast<float>(1.0 / scene.cloud->frame.unit);
    EXPECT_EQ(std::count(level.cloud->radius.begin(), level.cloud->radius.end(), local), 1);
    // What is small decides the error, and does not vanish.
    EXPECT_LT(level.error, 1e-3);
    EXPECT_GE(level.metaballs, 2u);
  }
  EXPECT_GE(fine, 2);
}

TEST(LevelOfDetail, IsChosenByTheCameraAndNeverCoarserThanAsked) {
  const PeerScene peer = MakeHeightField(40000, 320, 180);
  LevelsOfDetail levels(*peer.scene.cloud, peer.scene.surface);
  const Camera close = Camera::LookAt({0.5, 0.3, 0.2}, {0.5, 0, 0.5}, {0, 1, 0}, 1, 320, 180);
  EXPECT_EQ(levels.For(close, 0.5).level, nullptr);
  EXPECT_TRUE(levels.levels().empty()) << "work for a picture that needs none";
  // Within the metaballs no error can be stated.
  const Camera within = Camera::LookAt({0.5, 0, 0.5}, {0.5, 0, 0.6}, {0, 1, 0}, 1, 320, 180);
  EXPECT_EQ(levels.For(within, 1e6).level, nullptr);

  std::size_t before = peer.scene.cloud->size();
  for (const double distance : {20.0, 80.0, 320.0}) {
    const Camera camera = Camera::LookAt({0.5, 0.8 * distance, -0.6 * distance}, {0.5, 0, 0.5},
                                         {0, 1, 0}, 1, 320, 180);
    const LevelChoice choice = levels.For(camera, 0.5);
    ASSERT_NE(choice.level, nullptr) << distance;
    EXPECT_LT(choice.error_px, 0.5);
    EXPECT_GE(choice.error_px, choice.level->error * camera.fx / (1.1 * distance + 1));
    EXPECT_LT(choice.level->metaballs, before);
    before = choice.level->metaballs;
  }
  const std::size_t bytes = levels.MemoryBytes();
  std::size_t clouds = 0;
  for (const LevelOfDetail& level : levels.levels()) {
    if (level.cloud) clouds += level.cloud->MemoryBytes() + 4 * level.metaballs;
  }
  EXPECT_GE(bytes, clouds);
  EXPECT_LT(bytes, peer.scene.cloud->MemoryBytes());
}

TEST(LevelOfDetail, IsTheSameForAnyNumberOfThreads) {
  const PeerScene peer = MakeShell(200000);
  LevelsOfDetail one(*peer.scene.cloud, peer.scene.surface, 1);
  LevelsOfDetail many(*peer.scene.cloud, peer.scene.surface, 4);
  MakeAll(&one);
  MakeAll(&many);
  ASSERT_EQ(one.levels().size(), many.levels().size());
  for (std::size_t k = 0; k < one.levels().size(); ++k) {
    const LevelOfDetail &a = one.levels()[k], &b = many.levels()[k];
    EXPECT_EQ(a.error, b.error);
    ASSERT_EQ(a.metaballs, b.metaballs);
    EXPECT_EQ(a.representative, b.representative);
    EXPECT_EQ(a.cloud->radius, b.cloud->radius);
    EXPECT_EQ(a.cloud->color, b.cloud->color);
    for (std::size_t i = 0; i < a.metaballs; ++i) {
      ASSERT_EQ(a.cloud->center[i].x, b.cloud->center[i].x);
    }
  }
}

TEST(LevelOfDetail, IsTheSameFarFromTheOrigin) {
  CloudInput input = testing::RandomBall(3000, 0.125, 1, 9);
  for (Vec3d& p : input.center) {  // on a grid that also the shifted ones can hold
    for (double* v : {&p.x, &p.y, &p.z}) *v = std::nearbyint(*v * 1048576) / 1048576;
  }
  const Cloud here = BuildCloud(input);
  for (Vec3d& p : input.center) p = p + Vec3d{4194304, -8388608, 1048576};
  const Cloud there = BuildCloud(input);
  LevelsOfDetail a(here, Surface{}), b(there, Surface{});
  MakeAll(&a);
  MakeAll(&b);
  ASSERT_FALSE(a.levels().empty());
  ASSERT_EQ(a.levels().size(), b.levels().size());
  for (std::size_t k = 0; k < a.levels().size(); ++k) {
    EXPECT_EQ(a.levels()[k].metaballs, b.levels()[k].metaballs);
    EXPECT_EQ(a.levels()[k].error, b.levels()[k].error);
  }
}

TEST(LevelOfDetail, ColoursAreMeansInLinearLightAndChannelsMeans) {
  CloudInput input;
  input.center.assign(2, Vec3d{});
  input.uniform_radius = 1;
  input.color = {{0, 0, 0}, {255, 255, 255}};
  Channel height("height", ChannelType::kFloat32, 1, 2);
  height.Set(0, {{1}});
  height.Set(1, {{4}});
  Channel normal("normal", ChannelType::kOctahedral, 3, 2);
  normal.Set(0, {{1, 0, 0}});
  normal.Set(1, {{0, 1, 0}});
  input.channels = {height, normal};
  const Cloud cloud = BuildCloud(input);
  LevelsOfDetail levels(cloud, Surface{});
  MakeAll(&levels);
  ASSERT_EQ(levels.levels().size(), 1u);
  const Cloud& merged = *levels.levels()[0].cloud;
  EXPECT_EQ(merged.color[0], (Rgb8{188, 188, 188}));
  EXPECT_FLOAT_EQ(merged.FindChannel("height")->Get(0).v[0], 2.5f);
  EXPECT_NEAR(merged.FindChannel("normal")->Get(0).v[0], std::sqrt(0.5f), 1e-3);
  EXPECT_NEAR(merged.FindChannel("normal")->Get(0).v[1], std::sqrt(0.5f), 1e-3);
}

}  // namespace
}  // namespace sherd
