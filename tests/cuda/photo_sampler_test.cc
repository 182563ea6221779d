// The store of photographs: the CPU's colours exactly, whatever its size, and nothing loaded twice
// that it could have kept.
#include "cuda/photo_sampler.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <stop_token>
#include <vector>

#include "cuda/host_loop.h"
#include "cuda/renderers.h"
#include "cuda/tile_slots.h"
#include "metaball/error.h"
#include "photo_scenes.h"

namespace sherd {
namespace {

constexpr std::uint64_t kTile = 64 * 64 * 3;
constexpr int kWidth = 700, kHeight = 533;
constexpr std::size_t kCount = 3000;

struct Photo {
  explicit Photo(std::uint32_t id, int finest = 0, int width = kWidth, int height = kHeight)
      : extent{id, width, height, 0},
        pixels(MakeNoisePhoto(width, height, finest, id)),
        lookups(MakeLookups(id, width, height, kCount)) {}

  PhotoExtent extent;
  PhotoPyramid pixels;
  std::vector<PhotoLookup> lookups;

  std::vector<PhotoColors> On(PhotoSampler* sampler, bool give_pixels = true) const {
    std::vector<PhotoColors> colors(lookups.size());
    sampler->Sample(extent, give_pixels ? &pixels : nullptr, lookups, colors.data(), {});
    return colors;
  }
  std::vector<PhotoColors> OnCpu() const { return On(MakeCpuPhotoSampler().get()); }
};

bool Same(const std::vector<PhotoColors>& a, const std::vector<PhotoColors>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
}

TEST(PhotoSampler, GivesTheCpusColorsExactlyHoweverSmallThePool) {
  const Photo photo(1);
  const std::vector<PhotoColors> expected = photo.OnCpu();
  const auto roomy = MakeHostLoopPhotoSampler(std::uint64_t{64} << 20);
  EXPECT_TRUE(Same(photo.On(roomy.get()), expected));
  EXPECT_EQ(roomy->use().rounds, 1u);
  for (const std::uint64_t tiles : {12, 13, 40, 100}) {
    const auto tight = MakeHostLoopPhotoSampler(tiles * kTile);
    EXPECT_TRUE(Same(photo.On(tight.get()), expected)) << tiles;
    EXPECT_GT(tight->use().rounds, 1u) << tiles;
    EXPECT_LE(tight->use().pool_bytes, tiles * kTile);
    EXPECT_LE(tight->use().tiles_held, tiles);
  }
}

TEST(PhotoSampler, LongAndTinyPhotographsAreTiledToo) {
  for (const auto& [width, height] : {std::pair{1, 1}, {64, 64}, {65, 1}, {3, 2000}, {129, 128}}) {
    const Photo photo(2, 0, width, height);
    EXPECT_TRUE(Same(photo.On(MakeHostLoopPhotoSampler(24 * kTile).get()), photo.OnCpu()))
        << width << "x" << height;
  }
}

TEST(PhotoSampler, MoreLookupsThanAreWorkedOnAtOnce) {
  Photo photo(3);
  photo.lookups = MakeLookups(3, kWidth, kHeight, 150'000);
  const auto sampler = MakeHostLoopPhotoSampler(60 * kTile);
  EXPECT_TRUE(Same(photo.On(sampler.get()), photo.OnCpu()));
}

TEST(PhotoSampler, ReadsTheLevelsThatAreThere) {
  const Photo fine(4), coarse(4, 3);
  const auto sampler = MakeHostLoopPhotoSampler(std::uint64_t{16} << 20);
  EXPECT_TRUE(Same(coarse.On(sampler.get()), coarse.OnCpu()));
  EXPECT_TRUE(Same(fine.On(sampler.get()), fine.OnCpu())) << "tiles of coarse levels are shared";
}

TEST(PhotoSampler, WhatIsHeldNeedsNoPixelsAndIsNotLoadedAgain) {
  const Photo a(5), b(6);
  const auto sampler = MakeHostLoopPhotoSampler(std::uint64_t{16} << 20);
  EXPECT_TRUE(sampler->NeedsPixels(a.extent, a.lookups, {}));
  const std::vector<PhotoColors> first = a.On(sampler.get());
  b.On(sampler.get());
  EXPECT_FALSE(sampler->NeedsPixels(a.extent, a.lookups, {}));
  const std::uint64_t loaded = sampler->use().tiles_loaded;
  EXPECT_EQ(loaded, sampler->use().tiles_held);
  EXPECT_TRUE(Same(a.On(sampler.get(), false), first));
  EXPECT_EQ(sampler->use().tiles_loaded, loaded);
  EXPECT_TRUE(sampler->NeedsPixels(Photo(7).extent, a.lookups, {})) << "another photograph";
}

TEST(PhotoSampler, LetsGoOfWhatWasUsedLongestAgo) {
  const Photo a(8), b(9), c(10);
  const auto sampler = MakeHostLoopPhotoSampler(std::uint64_t{1} << 30);
  a.On(sampler.get());
  const std::uint64_t one = sampler->use().tiles_held;
  const auto tight = MakeHostLoopPhotoSampler((2 * one + 2) * kTile);
  a.On(tight.get());
  b.On(tight.get());
  a.On(tight.get());
  c.On(tight.get());
  EXPECT_FALSE(tight->NeedsPixels(a.extent, a.lookups, {}));
  EXPECT_TRUE(tight->NeedsPixels(b.extent, b.lookups, {}));
}

TEST(PhotoSampler, MemoryThatRunsOutMakesThePoolSmallerNotWrong) {
  constexpr std::uint64_t kChunk = 2048 * kTile;
  HostLoopOptions little;
  // The buffers beside the pool, and one of its chunks.
  const std::uint64_t buffers =
      65536 * (sizeof(PhotoLookup) + sizeof(PhotoColors)) + 128 * kTile + 65536;
  little.memory_bytes = buffers + kChunk;
  const auto sampler = MakeHostLoopPhotoSampler(5 * kChunk, little);
  for (std::uint32_t id = 20; id < 27; ++id) {
    const Photo photo(id, 0, 1500, 1100);
    EXPECT_TRUE(Same(photo.On(sampler.get()), photo.OnCpu())) << id;
  }
  EXPECT_EQ(sampler->use().pool_bytes, kChunk);
  EXPECT_GT(sampler->use().tiles_loaded, 2048u);

  const Photo photo(11);
  little.memory_bytes = buffers;
  EXPECT_THROW(photo.On(MakeHostLoopPhotoSampler(kChunk, little).get()), ResourceError);
  EXPECT_THROW(MakeHostLoopPhotoSampler(12 * kTile - 1), ResourceError);
}

TEST(PhotoSampler, StopsWhenAskedAndIsRightAfterwards) {
  const Photo photo(12);
  const auto sampler = MakeHostLoopPhotoSampler(40 * kTile);
  std::stop_source source;
  source.request_stop();
  Control control;
  control.stop = source.get_token();
  std::vector<PhotoColors> colors(photo.lookups.size());
  EXPECT_THROW(sampler->Sample(photo.extent, &photo.pixels, photo.lookups, colors.data(), control),
               Cancelled);
  EXPECT_TRUE(Same(photo.On(sampler.get()), photo.OnCpu()));
}

TEST(PhotoSampler, IsMadeForRenderersOnTheGpuAlone) {
  EXPECT_EQ(MakePhotoSampler(*MakeCpuRenderer()), nullptr);
  EXPECT_EQ(MakePhotoSampler(*MakeHostLoopRenderer()), nullptr);
  if (QueryCuda().available) return;
  EXPECT_THROW(MakeCudaPhotoSampler(0, 0), DeviceError);
}

TEST(TileSlots, AFailedLoadLosesNoSlot) {
  TileSlots slots;
  slots.AddSlots(3);
  const auto hold = [&](std::uint64_t key) {
    slots.MakeFree(1);
    slots.Hold(std::vector{key});
  };
  hold(1);
  hold(2);
  hold(3);
  EXPECT_TRUE(slots.Touch(1));
  slots.MakeFree(2);  // and nothing comes of it
  EXPECT_TRUE(slots.Holds(1));
  EXPECT_FALSE(slots.Holds(2));
  EXPECT_FALSE(slots.Touch(3));
  hold(4);
  hold(5);
  EXPECT_EQ(slots.held(), 3u);
  EXPECT_NE(slots.SlotOf(4), slots.SlotOf(5));
  EXPECT_NE(slots.SlotOf(1), slots.SlotOf(4));
  hold(6);
  EXPECT_FALSE(slots.Holds(1)) << "the one used longest ago";
}

}  // namespace
}  // namespace sherd
