// Photographs looked up elsewhere than on the CPU.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <span>
#include <utility>

#include "cuda/host_loop.h"
#include "metaball/error.h"
#include "reconstruction/photographs.h"
#include "tests/reconstruction/photo_board.h"

namespace sherd {
namespace {

using test::Board;

Frame Shaded(const Board& board, PhotographShader* shader, PhotoShadingStats* stats) {
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  *stats = shader->Shade(board.level, {}, camera, &frame);
  return frame;
}

bool SameColors(const Frame& a, const Frame& b) {
  return std::equal(a.color.begin(), a.color.end(), b.color.begin(), b.color.end(),
                    [](const Pixel& p, const Pixel& q) {
                      return p.r == q.r && p.g == q.g && p.b == q.b && p.a == q.a;
                    });
}

TEST(Sampling, OnAStoreOfTilesThePictureIsTheSame) {
  const Board board;
  PhotographShader on_cpu(board.survey), on_store(board.survey);
  PhotoShadingStats stats;
  const Frame expected = Shaded(board, &on_cpu, &stats);
  auto store = MakeHostLoopPhotoSampler(std::uint64_t{60} * 64 * 64 * 3);
  const PhotoTileSampler& tiles = *store;
  on_store.SampleOn(std::move(store));
  EXPECT_TRUE(SameColors(Shaded(board, &on_store, &stats), expected));
  EXPECT_GT(tiles.use().tiles_loaded, 0u);
  EXPECT_EQ(stats.photos_used, 3u);
  EXPECT_TRUE(stats.warnings.empty());
}

TEST(Sampling, WhatAStoreHoldsIsNotDecodedAgain) {
  const Board board;
  PhotographShader shader(board.survey);
  shader.SampleOn(MakeHostLoopPhotoSampler(std::uint64_t{64} << 20));
  PhotoShadingStats stats;
  const Frame first = Shaded(board, &shader, &stats);
  for (const Photograph& photo : board.survey.photographs) std::filesystem::remove(photo.path);
  EXPECT_TRUE(SameColors(Shaded(board, &shader, &stats), first));
  EXPECT_EQ(stats.photos_used, 3u);
}

// Fails at the third photograph it is given.
class FailingSampler final : public PhotoSampler {
 public:
  bool NeedsPixels(const PhotoExtent&, std::span<const PhotoLookup>, const Control&) override {
    return true;
  }
  void Sample(const PhotoExtent&, const PhotoPyramid*, std::span<const PhotoLookup> lookups,
              PhotoColors* colors, const Control&) override {
    if (++calls_ == 3) throw DeviceError("photo_sample", 700, "an illegal memory access");
    std::fill_n(colors, lookups.size(), PhotoColors{{9, 9, 9}, {9, 9, 9}});
  }

 private:
  int calls_ = 0;
};

TEST(Sampling, ADeviceThatFailsIsGivenUpForTheCpuWithAWarning) {
  const Board board;
  PhotographShader on_cpu(board.survey), failing(board.survey);
  PhotoShadingStats stats;
  const Frame expected = Shaded(board, &on_cpu, &stats);
  failing.SampleOn(std::make_unique<FailingSampler>());
  EXPECT_TRUE(SameColors(Shaded(board, &failing, &stats), expected));
  ASSERT_EQ(stats.warnings.size(), 1u);
  EXPECT_EQ(stats.warnings[0],
            "the photographs are looked up on the CPU: photo_sample: an illegal memory access");
  EXPECT_TRUE(SameColors(Shaded(board, &failing, &stats), expected)) << "and once more";
}

}  // namespace
}  // namespace sherd
