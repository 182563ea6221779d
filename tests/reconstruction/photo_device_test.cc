// Photographs on a surface by something else than the CPU: the kernels' pass over a store of tiles,
// and devices that fail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "cuda/host_loop.h"
#include "metaball/error.h"
#include "reconstruction/photographs.h"
#include "tests/reconstruction/photo_board.h"

namespace sherd {
namespace {

using test::Board;
using test::SameColors;

constexpr std::uint64_t kTile = 64 * 64 * 3;

Frame Shaded(const Board& board, PhotographShader* shader, PhotoShadingStats* stats,
             const Camera& camera = Board::View()) {
  Frame frame = board.Render(camera);
  *stats = shader->Shade(board.level, {}, camera, &frame);
  return frame;
}
Frame OnCpu(const Board& board, const Camera& camera = Board::View()) {
  PhotographShader shader(board.survey);
  PhotoShadingStats stats;
  return Shaded(board, &shader, &stats, camera);
}
// A shader by the kernels, and what it says of itself.
struct ByKernels {
  ByKernels(const Board& board, std::uint64_t pool_bytes, const HostLoopOptions& options = {})
      : shader(board.survey) {
    auto made = MakeHostLoopPhotoShader(pool_bytes, options);
    device = made.get();
    shader.ShadeOn(std::move(made));
  }
  PhotographShader shader;
  const ProfilingPhotoShader* device;  // until it is given up
  PhotoShadingStats stats;
};

TEST(PhotoDevice, ThePictureIsTheCpusHoweverSmallThePool) {
  const Board board;
  const Frame expected = OnCpu(board);
  for (const std::uint64_t tiles : {12, 13, 25, 60, 5000}) {
    ByKernels own(board, tiles * kTile);
    EXPECT_TRUE(SameColors(Shaded(board, &own.shader, &own.stats), expected)) << tiles;
    EXPECT_EQ(own.stats.photos_used, 3u);
    EXPECT_TRUE(own.stats.warnings.empty());
    EXPECT_LE(own.device->use().pool_bytes, tiles * kTile);
    EXPECT_LE(own.device->use().tiles_held, tiles);
    if (tiles == 5000) {
      EXPECT_EQ(own.device->use().rounds, 2u) << "one that finds nothing there, one that does";
      EXPECT_EQ(own.device->use().tiles_loaded, own.device->use().tiles_held);
    } else {
      EXPECT_GT(own.device->use().rounds, 2u);
    }
  }
}

// Lookups of a picture finer than the photographs, and of one so coarse that only small levels are
// read.
TEST(PhotoDevice, EveryLevelIsRead) {
  const Board board(2.5);
  for (const int width : {20, 90, 1600}) {
    const Camera camera = Board::View().Resized(width, width * 3 / 4);
    ByKernels own(board, std::uint64_t{64} << 20);
    EXPECT_TRUE(SameColors(Shaded(board, &own.shader, &own.stats, camera), OnCpu(board, camera)))
        << width;
  }
}

// What was read coarsely for one picture does not blur the next.
TEST(PhotoDevice, FinerLevelsAreReadWhenAPictureComesNearer) {
  const Board board(2.5);
  ByKernels own(board, std::uint64_t{64} << 20);
  for (const int width : {20, 1600, 90, 400}) {
    const Camera camera = Board::View().Resized(width, width * 3 / 4);
    EXPECT_TRUE(SameColors(Shaded(board, &own.shader, &own.stats, camera), OnCpu(board, camera)))
        << width;
  }
}

TEST(PhotoDevice, WhatIsHeldIsNotDecodedAgain) {
  const Board board;
  ByKernels own(board, std::uint64_t{64} << 20);
  const Frame first = Shaded(board, &own.shader, &own.stats);
  const auto before = own.device->use();
  for (const Photograph& photo : board.survey.photographs) std::filesystem::remove(photo.path);
  EXPECT_TRUE(SameColors(Shaded(board, &own.shader, &own.stats), first));
  EXPECT_EQ(own.stats.photos_used, 3u);
  EXPECT_EQ(own.device->use().tiles_loaded, before.tiles_loaded);
  EXPECT_EQ(own.device->use().rounds, before.rounds + 1);
}

TEST(PhotoDevice, LetsGoOfWhatWasLookedAtLongestAgo) {
  const Board board;
  const auto view = [](double x) {
    return Camera::LookAt({x, 0, 2}, {x, 0, 4}, {0, -1, 0}, 0.2, 60, 40);
  };
  const Camera a = view(-0.6), b = view(0), c = view(0.6);
  ByKernels roomy(board, std::uint64_t{64} << 20);
  std::uint64_t largest = 0, held = 0;
  for (const Camera& camera : {a, b, c}) {
    Shaded(board, &roomy.shader, &roomy.stats, camera);
    largest = std::max(largest, roomy.device->use().tiles_held - held);
    held = roomy.device->use().tiles_held;
  }
  ByKernels tight(board, (held - 1) * kTile);
  Shaded(board, &tight.shader, &tight.stats, a);
  Shaded(board, &tight.shader, &tight.stats, b);
  Shaded(board, &tight.shader, &tight.stats, a);
  Shaded(board, &tight.shader, &tight.stats, c);  // takes the place of something of b
  const std::uint64_t loaded = tight.device->use().tiles_loaded;
  EXPECT_TRUE(SameColors(Shaded(board, &tight.shader, &tight.stats, a), OnCpu(board, a)));
  EXPECT_EQ(tight.device->use().tiles_loaded, loaded) << "a was looked at after b";
  Shaded(board, &tight.shader, &tight.stats, b);
  EXPECT_GT(tight.device->use().tiles_loaded, loaded);
}

// A level that changed is brought over anew; one that is given again is not.
TEST(PhotoDevice, FollowsTheLevelAndTheSurface) {
  Board board;
  ByKernels own(board, std::uint64_t{16} << 20);
  PhotographShader cpu(board.survey);
  const Camera camera = Board::View();
  const auto expect_the_same = [&](const Surface& surface, const char* what) {
    Frame frame = board.Render(camera), expected = frame;
    own.shader.Shade(board.level, surface, camera, &frame);
    cpu.Shade(board.level, surface, camera, &expected);
    EXPECT_TRUE(SameColors(frame, expected)) << what;
  };
  expect_the_same({}, "first");
  expect_the_same({.threshold = 0.5}, "threshold");
  expect_the_same({}, "back again");
  board.level.photo_begin.clear();
  expect_the_same({}, "without lists");
  for (Vec3f& normal : board.level.normal) normal = Normalized(Vec3f{0.5f, 0, -1});
  expect_the_same({}, "normals");
  const auto shared = std::make_shared<const Level>(board.level);
  Frame frame = board.Render(camera), expected = frame;
  own.shader.Shade(shared, {}, camera, &frame);
  cpu.Shade(board.level, {}, camera, &expected);
  EXPECT_TRUE(SameColors(frame, expected));
}

TEST(PhotoDevice, MemoryThatRunsOutIsSaidAndTheCpuGoesOn) {
  const Board board;
  const Frame expected = OnCpu(board);
  HostLoopOptions little;
  little.memory_bytes = 10'000'000;  // less than the picture
  ByKernels own(board, 40 * kTile, little);
  EXPECT_TRUE(SameColors(Shaded(board, &own.shader, &own.stats), expected));
  ASSERT_EQ(own.stats.warnings.size(), 1u);
  EXPECT_THAT(own.stats.warnings[0], ::testing::HasSubstr("out of memory"));
  // A smaller picture is its own again.
  const Camera small = Board::View().Resized(40, 30);
  EXPECT_TRUE(SameColors(Shaded(board, &own.shader, &own.stats, small), OnCpu(board, small)));
  EXPECT_TRUE(own.stats.warnings.empty());
  EXPECT_THROW(MakeHostLoopPhotoShader(12 * kTile - 1), ResourceError);
}

TEST(PhotoDevice, StopsWhenAskedAndIsRightAfterwards) {
  const Board board;
  ByKernels own(board, 40 * kTile);
  std::stop_source source;
  Control control;
  control.stop = source.get_token();
  // At the first photograph that is decoded for the picture.
  control.progress = [&](std::string_view what, double) {
    if (what.find("projecting") != std::string_view::npos) source.request_stop();
  };
  Frame frame = board.Render(Board::View());
  const Frame before = frame;
  EXPECT_THROW(own.shader.Shade(board.level, {}, Board::View(), &frame, control), Cancelled);
  EXPECT_TRUE(SameColors(frame, before));
  EXPECT_TRUE(SameColors(Shaded(board, &own.shader, &own.stats), OnCpu(board)));
}

// Fails half way.
class FailingDevice final : public PhotoShader {
 public:
  void Shade(const PhotoScene&, const Camera&, PhotoPixels*, Frame*, PhotoCounts* counts,
             const Control&) override {
    counts->pixels = 17;
    throw DeviceError("ChoosePixelPhotos", 700, "an illegal memory access");
  }
};

TEST(PhotoDevice, OneThatFailsIsGivenUpForTheCpuWithAWarning) {
  const Board board;
  PhotographShader failing(board.survey);
  PhotoShadingStats stats;
  const Frame expected = OnCpu(board);
  failing.ShadeOn(std::make_unique<FailingDevice>());
  EXPECT_TRUE(SameColors(Shaded(board, &failing, &stats), expected));
  EXPECT_EQ(stats.pixels, 400u * 300);
  ASSERT_EQ(stats.warnings.size(), 1u);
  EXPECT_EQ(
      stats.warnings[0],
      "the photographs are looked up on the CPU: ChoosePixelPhotos: an illegal memory access");
  EXPECT_TRUE(SameColors(Shaded(board, &failing, &stats), expected)) << "and once more";
}

}  // namespace
}  // namespace sherd
