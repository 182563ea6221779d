// What the frame pipeline promises around the kernels: exact repetition, freedom from races between
// barriers, pictures in parts, refusals with figures, cancelling, scenes that change.
#include "cuda/host_loop.h"

#include <gtest/gtest.h>

#include <memory>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"
#include "picture_difference.h"
#include "scenes.h"

namespace sherd {
namespace {

RenderSettings AllPlanes(int supersample = 1) {
  RenderSettings settings;
  settings.planes = {true, true, true};
  settings.supersample = supersample;
  return settings;
}

bool SameFrame(const Frame& a, const Frame& b) {
  return SameBytes(a.color, b.color) && SameBytes(a.depth, b.depth) &&
         SameBytes(a.normal, b.normal) && SameBytes(a.id, b.id);
}

// Between two barriers the threads of a block may run in any order. A kernel in which one of them
// reads what another writes gives another picture here.
TEST(HostLoop, TheOrderOfThreadsBetweenBarriersDoesNotMatter) {
  for (const CheckScene& scene : MakeCheckScenes(4000, 96, 64)) {
    if (scene.scene.cloud->size() > 4500) continue;
    const auto render = [&](kernels::ThreadOrder order) {
      HostLoopOptions options;
      options.order = order;
      return MakeHostLoopRenderer(options)->Render(scene.scene, scene.camera,
                                                   AllPlanes(scene.supersample));
    };
    const Frame forward = render(kernels::ThreadOrder::kForward);
    EXPECT_TRUE(SameFrame(forward, render(kernels::ThreadOrder::kBackward))) << scene.name;
    EXPECT_TRUE(SameFrame(forward, render(kernels::ThreadOrder::kInterleaved))) << scene.name;
  }
}

TEST(HostLoop, RepeatsItselfExactlyWhateverWasDrawnBetween) {
  const PeerScene field = MakeHeightField(5000, 120, 80), shell = MakeShell(3000, 90, 70);
  const auto renderer = MakeHostLoopRenderer();
  const Frame first = renderer->Render(field.scene, field.camera, AllPlanes());
  renderer->Render(shell.scene, shell.camera, {});
  renderer->Render(field.scene, field.camera.Resized(31, 17), AllPlanes(2));
  EXPECT_TRUE(SameFrame(first, renderer->Render(field.scene, field.camera, AllPlanes())));
  RenderSettings one_thread = AllPlanes();
  one_thread.threads = 1;
  EXPECT_TRUE(SameFrame(first, renderer->Render(field.scene, field.camera, one_thread)));
}

TEST(HostLoop, ARecycledFrameLeavesNothingInTheNext) {
  const PeerScene field = MakeHeightField(2000, 90, 60);
  Camera away = field.camera;  // sees nothing
  away.forward = -field.camera.forward;
  away.right = -field.camera.right;
  const auto renderer = MakeHostLoopRenderer();
  const Frame fresh = renderer->Render(field.scene, field.camera, AllPlanes());
  const Frame nothing = renderer->Render(field.scene, away, AllPlanes());
  for (const Camera& before : {field.camera, field.camera.Resized(120, 70)}) {
    Frame frame = renderer->Render(field.scene, before, AllPlanes());
    const Pixel* const memory = frame.color.data();
    renderer->Recycle(std::move(frame));
    frame = renderer->Render(field.scene, away, AllPlanes());
    EXPECT_EQ(frame.color.data(), memory);
    EXPECT_TRUE(SameFrame(frame, nothing));
    renderer->Recycle(std::move(frame));
    EXPECT_TRUE(SameFrame(renderer->Render(field.scene, field.camera, AllPlanes()), fresh));
  }
  Scene empty;
  empty.cloud = std::make_shared<Cloud>();
  renderer->Recycle(renderer->Render(field.scene, field.camera, AllPlanes()));
  EXPECT_TRUE(SameFrame(renderer->Render(empty, field.camera, AllPlanes()), nothing));
}

TEST(HostLoop, PlanesThatAreNotAskedForAreNotMade) {
  const PeerScene field = MakeHeightField(1000, 40, 30);
  const Frame frame = MakeHostLoopRenderer()->Render(field.scene, field.camera, {});
  EXPECT_EQ(frame.color.size(), 1200u);
  EXPECT_TRUE(frame.depth.empty() && frame.normal.empty() && frame.id.empty());
}

TEST(HostLoop, ANewCloudIsNotTakenForTheOldOne) {
  const auto renderer = MakeHostLoopRenderer();
  // Clouds of one size, made and thrown away: the allocator is free to give the same address again.
  for (int i = 0; i < 4; ++i) {
    CloudInput input;
    input.center = {{0, 0, 0}};
    input.uniform_radius = 1;
    input.color = {i % 2 ? Rgb8{255, 0, 0} : Rgb8{0, 0, 255}};
    Scene scene;
    scene.cloud = std::make_shared<Cloud>(BuildCloud(input));
    scene.lighting.unlit = true;
    const Camera camera = Camera::LookAt({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 0.2, 5, 5);
    const Pixel pixel = renderer->Render(scene, camera, {}).color[12];
    EXPECT_EQ(pixel.r, i % 2 ? 1.0f : 0.0f);
    EXPECT_EQ(pixel.b, i % 2 ? 0.0f : 1.0f);
  }
}

TEST(HostLoop, LittleMemoryMeansPartsAndTheSamePicture) {
  const PeerScene field = MakeHeightField(4000, 256, 144);
  for (const int supersample : {1, 2}) {
    const Frame whole =
        MakeHostLoopRenderer()->Render(field.scene, field.camera, AllPlanes(supersample));
    HostLoopOptions options;
    options.memory_bytes = 900'000;
    const Frame parts =
        MakeHostLoopRenderer(options)->Render(field.scene, field.camera, AllPlanes(supersample));
    EXPECT_GT(parts.stats.tile_entries, whole.stats.tile_entries * 9 / 10);
    EXPECT_LT(parts.stats.bytes, options.memory_bytes);
    EXPECT_GT(whole.stats.bytes, options.memory_bytes);
    EXPECT_EQ(parts.stats.hits, whole.stats.hits);
    for (std::size_t i = 0; i < whole.color.size(); ++i) {
      // The camera of a part is the same up to the last bits of its rays.
      ASSERT_NEAR(parts.color[i].r, whole.color[i].r, 2e-5);
      ASSERT_NEAR(parts.color[i].a, whole.color[i].a, 1e-6);
      ASSERT_NEAR(parts.depth[i], whole.depth[i], 1e-5);
    }
  }
}

// How often the kernel of that name was launched for the last frame.
int Launches(const ProfilingRenderer& renderer, const std::string& name) {
  int count = 0;
  for (const KernelTime& kernel : renderer.LastKernels()) count += kernel.name == name;
  return count;
}

// What a picture needs is known to a few per cent only: one that just does not fit fails half way.
// The frame after it begins with what fitted.
TEST(HostLoop, APictureThatDidNotFitIsNotTriedWholeAgain) {
  const PeerScene field = MakeHeightField(4000, 256, 144);
  int learned = 0;
  for (std::uint64_t bytes = 900'000; bytes < 2'900'000; bytes += 50'000) {
    HostLoopOptions options;
    options.memory_bytes = bytes;
    const auto renderer = MakeHostLoopRenderer(options);
    renderer->EnableProfile(true);
    const Frame first = renderer->Render(field.scene, field.camera, AllPlanes(2));
    const int launches = Launches(*renderer, "MeasureBounds");
    const Frame second = renderer->Render(field.scene, field.camera, AllPlanes(2));
    EXPECT_LE(Launches(*renderer, "MeasureBounds"), launches) << bytes;
    learned += Launches(*renderer, "MeasureBounds") < launches;
    EXPECT_TRUE(SameFrame(first, second)) << bytes;
  }
  EXPECT_GT(learned, 0);
}

// The densities that are compared are brought over once, while there is room for them.
TEST(HostLoop, HoldsTheCloudsItDrewLast) {
  const PeerScene field = MakeHeightField(4000, 60, 40), coarse = MakeHeightField(900, 60, 40);
  PeerScene other = MakeShell(4000, 60, 40);
  const auto bytes_of = [&](std::uint64_t memory) {
    HostLoopOptions options;
    options.memory_bytes = memory;
    const auto renderer = MakeHostLoopRenderer(options);
    const Frame first = renderer->Render(field.scene, field.camera, AllPlanes());
    for (int i = 0; i < 3; ++i) {
      renderer->Render(coarse.scene, coarse.camera, AllPlanes());
      EXPECT_TRUE(SameFrame(renderer->Render(field.scene, field.camera, AllPlanes()), first));
      renderer->Render(other.scene, other.camera, AllPlanes());
    }
  };
  bytes_of(std::uint64_t{64} << 20);
  bytes_of(600'000);
}

TEST(HostLoop, WhatDoesNotFitIsRefusedWithTheFiguresAndTheRendererLives) {
  const PeerScene field = MakeHeightField(4000, 64, 48), small = MakeHeightField(100, 64, 48);
  HostLoopOptions options;
  options.memory_bytes = 200'000;
  const auto renderer = MakeHostLoopRenderer(options);
  try {
    renderer->Render(field.scene, field.camera, {});
    FAIL() << "4000 metaballs do not fit in 200 kB";
  } catch (const ResourceError& error) {
    EXPECT_GT(error.needed(), error.available());
    EXPECT_LE(error.available(), options.memory_bytes);
    EXPECT_NE(std::string(error.what()).find("3969 metaballs"), std::string::npos) << error.what();
  }
  EXPECT_GT(renderer->Render(small.scene, small.camera, {}).stats.hits, 0u);
  // Enough for the cloud, not for one tile's list of 300 thousand entries.
  CloudInput coincident;
  coincident.center.assign(6000, {0, 0, 0});
  coincident.uniform_radius = 1;
  Scene scene;
  scene.cloud = std::make_shared<Cloud>(BuildCloud(coincident));
  options.memory_bytes = 6000 * 52 + 40'000;
  const auto tight = MakeHostLoopRenderer(options);
  EXPECT_THROW(tight->Render(scene, field.camera, {}), ResourceError);
  EXPECT_GT(tight->Render(small.scene, small.camera, {}).stats.hits, 0u);
}

TEST(HostLoop, PicturesWiderThanSixteenBitsAreDrawnInParts) {
  const PeerScene field = MakeHeightField(400, 1280, 720);
  const Camera wide = field.camera.Resized(70'000, 3);
  const Frame frame = MakeHostLoopRenderer()->Render(field.scene, wide, {});
  const Frame cpu = MakeCpuRenderer()->Render(field.scene, wide, {});
  EXPECT_EQ(frame.stats.hits, cpu.stats.hits);
  EXPECT_GT(cpu.stats.hits, 1000u);
}

TEST(HostLoop, StopsWhenAskedAndWorksAfterwards) {
  const PeerScene field = MakeHeightField(5000, 200, 150);
  const auto renderer = MakeHostLoopRenderer();
  std::stop_source source;
  Control control;
  control.stop = source.get_token();
  source.request_stop();
  EXPECT_THROW(renderer->Render(field.scene, field.camera, {}, control), Cancelled);
  EXPECT_GT(renderer->Render(field.scene, field.camera, {}).stats.hits, 0u);
}

TEST(HostLoop, CountsItsWork) {
  const PeerScene field = MakeHeightField(5000, 120, 80);
  const FrameWork work = CountFrameWork(field.scene, field.camera, {});
  const Frame frame = MakeHostLoopRenderer()->Render(field.scene, field.camera, {});
  EXPECT_GE(work.steps, frame.stats.hits);  // a hit takes a step at least
  EXPECT_GE(work.adds, work.steps);
  EXPECT_GE(work.tests, frame.stats.hits);
  EXPECT_GE(work.shade_adds, frame.stats.hits);
  EXPECT_EQ(work.wide_rays, 0u);
  Scene thick = field.scene;
  thick.surface.radius_scale = 4;
  EXPECT_GT(CountFrameWork(thick, field.camera, {}).wide_rays, 1000u);
}

TEST(HostLoop, ChecksItsInput) {
  const PeerScene field = MakeHeightField(100, 20, 10);
  const auto renderer = MakeHostLoopRenderer();
  Scene scene = field.scene;
  scene.surface.threshold = 0;
  EXPECT_THROW(renderer->Render(scene, field.camera, {}), Error);
  scene = field.scene;
  scene.cloud = nullptr;
  EXPECT_THROW(renderer->Render(scene, field.camera, {}), Error);
  RenderSettings settings;
  settings.supersample = 9;
  EXPECT_THROW(renderer->Render(field.scene, field.camera, settings), Error);
}

}  // namespace
}  // namespace sherd
