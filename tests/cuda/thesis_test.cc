// The thesis's method by the CUDA kernel's body: in doubles the CPU's pictures exactly, in floats
// nearly; and what the pipeline around it promises.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "cuda/cuda_thesis_renderer.h"
#include "cuda/kernels/thesis_rays.h"
#include "cuda/renderers.h"
#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"
#include "metaball/local_view.h"
#include "metaball/moving.h"
#include "picture_difference.h"
#include "scenes.h"

namespace sherd {
namespace {

RenderSettings AllPlanes(int supersample = 1) {
  RenderSettings settings;
  settings.planes.depth = settings.planes.normal = settings.planes.id = true;
  settings.supersample = supersample;
  return settings;
}

void ExpectSame(const Frame& a, const Frame& b, const std::string& what) {
  EXPECT_TRUE(SameBytes(a.color, b.color)) << what;
  EXPECT_TRUE(SameBytes(a.depth, b.depth)) << what;
  EXPECT_TRUE(SameBytes(a.normal, b.normal)) << what;
  EXPECT_TRUE(SameBytes(a.id, b.id)) << what;
  EXPECT_EQ(a.stats.hits, b.stats.hits) << what;
  EXPECT_EQ(a.stats.rays_started_inside, b.stats.rays_started_inside) << what;
  EXPECT_EQ(a.stats.unresolved, b.stats.unresolved) << what;
}

Frame OnCpu(const ThesisOptions& options, const Scene& scene, const Camera& camera,
            const RenderSettings& settings = AllPlanes()) {
  return MakeThesisRenderer(options)->Render(scene, camera, settings);
}
Frame InDoubles(const ThesisOptions& options, const Scene& scene, const Camera& camera,
                const RenderSettings& settings = AllPlanes()) {
  return MakeHostLoopThesisRenderer(options)->Render(scene, camera, settings);
}
Frame InFloats(const ThesisOptions& options, const Scene& scene, const Camera& camera) {
  return MakeHostLoopThesisRenderer(options, ThesisPrecision::kFloat)
      ->Render(scene, camera, AllPlanes());
}

// A ball of coloured metaballs with what the flags ask for, else uniform.
CloudInput Ball(int count, double radius, bool own_radius, bool own_threshold,
                std::uint64_t seed = 1) {
  const int channels =
      kOwnColor | (own_radius ? kOwnRadius : 0) | (own_threshold ? kOwnThreshold : 0);
  return MakeBall(count, radius, 2, channels, seed, 0.45);
}

Camera Front(int width = 64, int height = 48) {
  return Camera::LookAt({0.3, 0.5, -3.5}, {0, 0, 0}, {0, 1, 0}, 0.8, width, height);
}

TEST(ThesisKernel, DrawsTheCpusPicturesInDoubles) {
  std::uint64_t hits = 0, inside = 0;
  for (const CheckScene& check : MakeCheckScenes(3000, 64, 48)) {
    for (const bool gated : {true, false}) {
      const ThesisOptions options{.depth = gated ? 7 : 4, .gated = gated};
      const RenderSettings settings = AllPlanes(check.supersample);
      const Frame cpu = OnCpu(options, check.scene, check.camera, settings);
      ExpectSame(cpu, InDoubles(options, check.scene, check.camera, settings),
                 check.name + (gated ? ", gated" : ""));
      hits += cpu.stats.hits;
      inside += cpu.stats.rays_started_inside;
    }
  }
  EXPECT_GT(hits, 50'000u);
  EXPECT_GT(inside, 1000u);
}

TEST(ThesisKernel, ThresholdsAndRadiiOfEachMetaballAsOnTheCpu) {
  for (const bool own_radius : {false, true}) {
    for (const bool own_threshold : {false, true}) {
      Scene scene = SceneOf(Ball(800, 0.25, own_radius, own_threshold), 0.4);
      std::vector<std::uint64_t> hits;
      for (const ThresholdMode mode : {ThresholdMode::kUniform, ThresholdMode::kBlended,
                                       ThresholdMode::kSummed, ThresholdMode::kGated}) {
        scene.surface.mode = mode;
        const ThesisOptions options{.depth = 5, .gated = false};
        const Frame cpu = OnCpu(options, scene, Front());
        ExpectSame(cpu, InDoubles(options, scene, Front()), NameOf(mode));
        hits.push_back(cpu.stats.hits);
      }
      EXPECT_GT(hits[0], 300u);
      EXPECT_NE(hits[2], hits[3]);  // the modes are told apart
    }
  }
}

TEST(ThesisKernel, EveryDensityAsOnTheCpu) {
  for (const DensityModel& density : AllDensities()) {
    Scene scene = SceneOf(Ball(300, 0.3, true, false), 0.3 * std::min(1.0, PeakOf(density)));
    scene.surface.density = density;
    const Frame cpu = OnCpu({.depth = 4, .gated = false}, scene, Front());
    EXPECT_GT(cpu.stats.hits, 100u) << TextOf(density);
    ExpectSame(cpu, InDoubles({.depth = 4, .gated = false}, scene, Front()), TextOf(density));
  }
}

TEST(ThesisKernel, NodesThatTakeMoreThanThereIsRoomForLoseNothing) {
  for (const bool own : {false, true}) {
    Scene scene = SceneOf(Ball(600, 0.9, own, own), 0.4);
    scene.surface.mode = ThresholdMode::kBlended;
    // The middle ray meets more, all of them in the first nodes.
    const Camera local = LocalCamera(Front(), scene.cloud->frame);
    const RayD ray = RayThrough(local, 32, 24);
    std::uint32_t met = 0;
    for (std::uint32_t i = 0; i < scene.cloud->size(); ++i) {
      RayMetaball m;
      met += MeetMetaball(scene.cloud->center[i].cast<double>() - ray.origin, ray.direction,
                          static_cast<double>(scene.cloud->RadiusOf(i)), i, &m);
    }
    ASSERT_GT(met, 3 * kernels::kThesisRoom);
    for (const bool gated : {true, false}) {
      for (const int depth : {1, 2, 3}) {
        const ThesisOptions options{.depth = depth, .gated = gated};
        const Frame cpu = OnCpu(options, scene, Front());
        EXPECT_GT(cpu.stats.hits, 500u);
        ExpectSame(cpu, InDoubles(options, scene, Front()), "depth " + std::to_string(depth));
      }
    }
  }
}

TEST(ThesisKernel, EveryDepthOfTheOctreeAsOnTheCpu) {
  const Scene scene = SceneOf(Ball(2000, 0.1, false, false));
  for (int depth = 1; depth <= 9; ++depth) {
    ExpectSame(OnCpu({.depth = depth}, scene, Front()), InDoubles({.depth = depth}, scene, Front()),
               "depth " + std::to_string(depth));
  }
}

// How far floats are from doubles: the share of the pixels that doubles draw where floats draw
// nothing or another place, by more than a hundredth of the smallest radius, or the reverse; and
// where both draw the same place, the largest difference of a colour's component.
struct FloatDifference {
  double elsewhere = 0, color = 0;
};
FloatDifference Compare(const Frame& floats, const Frame& doubles, const Scene& scene) {
  double smallest = scene.cloud->uniform_radius;
  for (const float r : scene.cloud->radius) {
    smallest = std::min(smallest > 0 ? smallest : r, static_cast<double>(r));
  }
  smallest *= scene.cloud->frame.unit * scene.surface.radius_scale;
  FloatDifference d;
  double drawn = 0;
  for (std::size_t i = 0; i < doubles.id.size(); ++i) {
    const bool hit = doubles.id[i] >= 0, float_hit = floats.id[i] >= 0;
    if (!hit && !float_hit) continue;
    ++drawn;
    if (hit != float_hit ||
        !(std::abs(static_cast<double>(doubles.depth[i]) - floats.depth[i]) < 0.01 * smallest)) {
      ++d.elsewhere;
      continue;
    }
    const Pixel &p = doubles.color[i], &q = floats.color[i];
    d.color = std::max({d.color, std::abs(static_cast<double>(p.r) - q.r),
                        std::abs(static_cast<double>(p.g) - q.g),
                        std::abs(static_cast<double>(p.b) - q.b)});
  }
  d.elsewhere /= std::max(1.0, drawn);
  return d;
}

// At most one pixel in a thousand is drawn elsewhere: where a ray only just meets something, it may
// take the next thing.
TEST(ThesisKernel, FloatsDrawNearlyTheSame) {
  const auto check = [](const Scene& scene, const Camera& camera, const ThesisOptions& options) {
    const Frame doubles = OnCpu(options, scene, camera);
    EXPECT_GT(doubles.stats.hits, 5000u);
    const FloatDifference d = Compare(InFloats(options, scene, camera), doubles, scene);
    EXPECT_LE(d.elsewhere, 1e-3);
    EXPECT_LE(d.color, 1e-3);
  };
  for (const PeerScene& peer : {MakeHeightField(20000, 160, 90), MakeShell(20000, 160, 90)}) {
    for (const bool gated : {true, false}) check(peer.scene, peer.camera, {.gated = gated});
  }
  for (const bool own : {false, true}) {
    Scene scene = SceneOf(Ball(2000, 0.15, own, own), 0.4);
    scene.surface.mode = ThresholdMode::kBlended;
    check(scene, Front(160, 120), {.depth = 5, .gated = false});
  }
}

// A million radii away: floats that were counted from the camera would be off by a tenth of a
// radius.
TEST(ThesisKernel, FloatsDrawWhatADistantCameraSees) {
  const Scene scene = SceneOf(Ball(2000, 0.15, false, false), 0.4);
  const Camera cameras[] = {
      Camera::LookAt({30e3, 50e3, -140e3}, {0, 0, 0}, {0, 1, 0}, 1.5e-5, 100, 80),
      Camera::LookAtOrthographic({30e3, 50e3, -140e3}, {0, 0, 0}, {0, 1, 0}, 2.2, 100, 80)};
  for (const Camera& camera : cameras) {
    const Frame doubles = OnCpu({.depth = 5}, scene, camera);
    const Frame floats = InFloats({.depth = 5}, scene, camera);
    EXPECT_GT(doubles.stats.hits, 5000u);
    int elsewhere = 0;
    for (std::size_t i = 0; i < doubles.id.size(); ++i) {
      elsewhere += doubles.id[i] != floats.id[i] ? 1 : 0;
    }
    EXPECT_LE(elsewhere, 8);  // of 8000
  }
}

TEST(ThesisPipeline, LittleMemoryMeansBandsAndTheSamePicture) {
  const PeerScene peer = MakeHeightField(2000, 200, 150);
  const ThesisOptions options{.depth = 4};
  const Frame whole = InDoubles(options, peer.scene, peer.camera);
  HostLoopOptions machine;
  machine.memory_bytes = 300'000;
  const auto tight = MakeHostLoopThesisRenderer(options, ThesisPrecision::kDouble, machine);
  for (int i = 0; i < 2; ++i) {
    const Frame bands = tight->Render(peer.scene, peer.camera, AllPlanes());
    ExpectSame(whole, bands, "bands");
    EXPECT_LT(bands.stats.bytes, machine.memory_bytes);
  }
  EXPECT_GT(whole.stats.bytes, 900'000u);
}

TEST(ThesisPipeline, WhatDoesNotFitIsRefusedWithTheFiguresAndTheRendererLives) {
  const PeerScene peer = MakeHeightField(4000, 64, 48), small = MakeHeightField(100, 64, 48);
  HostLoopOptions machine;
  machine.memory_bytes = 80'000;
  const auto renderer = MakeHostLoopThesisRenderer({.depth = 4}, ThesisPrecision::kFloat, machine);
  try {
    renderer->Render(peer.scene, peer.camera, {});
    FAIL() << "4000 metaballs do not fit in 80 kB";
  } catch (const ResourceError& error) {
    EXPECT_GT(error.needed(), error.available());
    EXPECT_LE(error.available(), machine.memory_bytes);
    EXPECT_NE(std::string(error.what()).find("3969 metaballs"), std::string::npos) << error.what();
  }
  EXPECT_GT(renderer->Render(small.scene, small.camera, {}).stats.hits, 0u);
  // A row of 100 000 pixels is 1.6 MB.
  try {
    renderer->Render(small.scene, small.camera.Resized(100'000, 2), {});
    FAIL() << "a row does not fit in 80 kB";
  } catch (const ResourceError& error) {
    EXPECT_EQ(error.needed(), 1'600'000u);
    EXPECT_NE(std::string(error.what()).find("one row"), std::string::npos) << error.what();
  }
  EXPECT_GT(renderer->Render(small.scene, small.camera, {}).stats.hits, 0u);
}

TEST(ThesisPipeline, KeepsTheOctreeUntilSomethingChanges) {
  MovingCloud moving(Ball(300, 0.3, false, true));
  Scene scene;
  scene.cloud = moving.cloud();
  scene.surface.mode = ThresholdMode::kBlended;
  const ThesisOptions options{.depth = 4, .gated = false};
  const auto kept = MakeHostLoopThesisRenderer(options);
  const auto kept_cpu = MakeThesisRenderer(options);
  Frame before;
  const auto expect_anew = [&](const std::string& what) {
    const Frame frame = kept->Render(scene, Front(), AllPlanes());
    EXPECT_FALSE(SameBytes(frame.color, before.color)) << what;
    ExpectSame(frame, InDoubles(options, scene, Front()), what);
    ExpectSame(frame, kept_cpu->Render(scene, Front(), AllPlanes()), what);
    ExpectSame(frame, kept->Render(scene, Front(), AllPlanes()), what + ", again");
    before = frame;
  };
  expect_anew("first");
  std::vector<Vec3d> positions;
  for (const Vec3d& p : Ball(300, 0.3, false, false, 7).center) positions.push_back(p);
  moving.SetPositions(positions);
  expect_anew("positions");
  moving.SetUniformRadius(0.25);
  expect_anew("radius");
  moving.SetThresholds(std::vector<double>(300, 0.2));
  expect_anew("thresholds");
  moving.SetColors(std::vector<Rgb8>(300, Rgb8{10, 200, 30}));
  expect_anew("colours");
  scene.surface.radius_scale = 1.2;
  expect_anew("radius factor");
  scene.surface.threshold = 0.3;  // no octree hangs on the rest
  scene.surface.mode = ThresholdMode::kUniform;
  expect_anew("threshold");
  Scene other = SceneOf(Ball(300, 0.3, false, false, 9));
  ExpectSame(kept->Render(other, Front(), AllPlanes()), InDoubles(options, other, Front()),
             "cloud");
}

TEST(ThesisPipeline, FillsTheStatsAndOnlyThePlanesAskedFor) {
  const PeerScene peer = MakeHeightField(1000, 40, 30);
  const auto renderer = MakeHostLoopThesisRenderer({.depth = 5}, ThesisPrecision::kFloat);
  const Frame frame = renderer->Render(peer.scene, peer.camera, {});
  EXPECT_EQ(frame.color.size(), 1200u);
  EXPECT_TRUE(frame.depth.empty() && frame.normal.empty() && frame.id.empty());
  EXPECT_EQ(frame.stats.rays, 1200u);
  EXPECT_EQ(frame.stats.metaballs, peer.scene.cloud->size());
  EXPECT_GT(frame.stats.hits, 100u);
  EXPECT_GT(frame.stats.bytes, 0u);
  EXPECT_GT(frame.stats.seconds_prepare, 0.0);
  EXPECT_GT(frame.stats.seconds_trace, 0.0);
  EXPECT_EQ(frame.stats.backend, "host-loop");
  EXPECT_NE(frame.stats.device.find("depth 5, floats"), std::string::npos) << frame.stats.device;
  RenderSettings gather;
  gather.planes.weight = true;
  EXPECT_THROW(renderer->Render(peer.scene, peer.camera, gather), Error);
}

TEST(ThesisPipeline, DrawsAnAppearanceAsTheCpuDoes) {
  PeerScene peer = MakeHeightField(1000, 60, 40);
  const Frame plain = InDoubles({}, peer.scene, peer.camera);
  Light sun;
  sun.kind = LightKind::kDirectional;
  sun.to_light = {0.9, 0.3, 0.2};
  peer.scene.appearance.lights = {sun};
  peer.scene.appearance.shadows.enabled = true;
  peer.scene.appearance.filter = 3;
  const Frame lit = InDoubles({}, peer.scene, peer.camera);
  ExpectSame(lit, OnCpu({}, peer.scene, peer.camera), "lit");
  EXPECT_FALSE(SameBytes(lit.color, plain.color));
}

TEST(ThesisPipeline, StopsWhenAskedAndWorksAfterwards) {
  const PeerScene peer = MakeHeightField(5000, 200, 150);
  const auto renderer = MakeHostLoopThesisRenderer();
  std::stop_source source;
  Control control;
  control.stop = source.get_token();
  // At the octree's report: the stop is seen while it is built.
  control.progress = [&](std::string_view, double) { source.request_stop(); };
  EXPECT_THROW(renderer->Render(peer.scene, peer.camera, AllPlanes(), control), Cancelled);
  // The octree is not half there.
  const Frame after = renderer->Render(peer.scene, peer.camera, AllPlanes());
  ExpectSame(after, OnCpu({}, peer.scene, peer.camera), "after");
  EXPECT_THROW(renderer->Render(peer.scene, peer.camera, AllPlanes(), control), Cancelled);
  ExpectSame(after, renderer->Render(peer.scene, peer.camera, AllPlanes()), "after the second");
}

TEST(ThesisPipeline, RefusesOptionsOutOfRangeAndSaysWhereThereIsNoGpu) {
  EXPECT_THROW(MakeHostLoopThesisRenderer({.depth = 11}), Error);
  EXPECT_THROW(MakeHostLoopThesisRenderer({.step = 0}), Error);
  EXPECT_THROW(MakeCudaThesisRenderer({}, {.tolerance = -1}), Error);
  if (QueryCuda().available) {
    EXPECT_EQ(MakeCudaThesisRenderer(FirstUsableGpu())->backend(), "cuda");
  } else {
    EXPECT_THROW(MakeCudaThesisRenderer({}), DeviceError);
  }
}

}  // namespace
}  // namespace sherd
