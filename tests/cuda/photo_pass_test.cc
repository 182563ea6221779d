// Photographs on a surface by the kernels' bodies: the formulas' own colours, whatever the pool.
// With real files, holes and failures: tests/reconstruction/photo_device_test.cc.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "cuda/host_loop.h"
#include "cuda/photo_shader.h"
#include "cuda/renderers.h"
#include "metaball/error.h"
#include "metaball/photo/photo_choice.h"
#include "photo_scenes.h"
#include "picture_difference.h"

namespace sherd {
namespace {

constexpr std::uint64_t kTile = 64 * 64 * 3;

bool SameColors(const Frame& a, const Frame& b) { return SameBytes(a.color, b.color); }

TEST(PhotoPass, GivesTheFormulasColorsHoweverSmallThePool) {
  PhotoField field({});
  const Frame surface = field.Render();
  Frame expected = surface;
  field.ShadePlainly(&expected);
  EXPECT_FALSE(SameColors(expected, surface));
  for (const std::uint64_t tiles : {12, 30, 100, 5000}) {
    const auto shader = MakeHostLoopPhotoShader(tiles * kTile);
    for (int i = 0; i < 2; ++i) {
      Frame frame = surface;
      PhotoCounts counts;
      shader->Shade(field.scene(), field.camera(), &field, &frame, &counts, {});
      EXPECT_TRUE(SameColors(frame, expected)) << tiles;
      EXPECT_EQ(counts.pixels, static_cast<std::uint64_t>(std::ranges::count_if(
                                   surface.id, [](std::int32_t id) { return id >= 0; })));
      EXPECT_EQ(counts.from_photos + counts.without_photo, counts.pixels);
      EXPECT_GT(counts.from_photos, counts.pixels * 3 / 4);
      EXPECT_GT(std::ranges::count(counts.used, true), 4);
    }
  }
}

TEST(PhotoPass, CarriesTheSurfaceAcrossHolesAndShowsThem) {
  PhotoField field({.holes = true});
  const Frame surface = field.Render();
  Frame filled = surface, marked = surface;
  PhotoCounts counts;
  const auto shader = MakeHostLoopPhotoShader(5000 * kTile);
  shader->Shade(field.scene(), field.camera(), &field, &filled, &counts, {});
  const std::uint64_t across = counts.across_holes;
  EXPECT_GT(across, 20u);
  PhotoScene scene = field.scene();
  scene.show_unseen = true;
  shader->Shade(scene, field.camera(), &field, &marked, &counts, {});
  EXPECT_EQ(counts.across_holes, 0u);
  EXPECT_GE(counts.without_photo, across);
  EXPECT_FALSE(SameColors(filled, marked));
}

TEST(PhotoPass, MemoryThatRunsOutMakesThePoolSmallerNotWrong) {
  constexpr std::uint64_t kChunk = 2048 * kTile;
  PhotoField field(
      {.width = 800, .height = 600, .photos = 30, .photo_width = 2000, .photo_height = 1500});
  const Frame surface = field.Render();
  Frame expected = surface;
  field.ShadePlainly(&expected);
  HostLoopOptions little;
  little.memory_bytes = kChunk + 180'000'000;
  const auto shader = MakeHostLoopPhotoShader(5 * kChunk, little);
  Frame frame = surface;
  PhotoCounts counts;
  shader->Shade(field.scene(), field.camera(), &field, &frame, &counts, {});
  EXPECT_TRUE(SameColors(frame, expected));
  EXPECT_EQ(shader->use().pool_bytes, kChunk);
  EXPECT_GT(shader->use().tiles_loaded, 2048u);

  little.memory_bytes = 4'000'000;
  frame = surface;
  EXPECT_THROW(MakeHostLoopPhotoShader(kChunk, little)
                   ->Shade(field.scene(), field.camera(), &field, &frame, &counts, {}),
               ResourceError);
  EXPECT_TRUE(SameColors(frame, surface));
  EXPECT_THROW(MakeHostLoopPhotoShader(12 * kTile - 1), ResourceError);
}

TEST(PhotoPass, IsMadeForRenderersOnTheGpuAlone) {
  EXPECT_EQ(MakePhotoShader(*MakeCpuRenderer()), nullptr);
  EXPECT_EQ(MakePhotoShader(*MakeHostLoopRenderer()), nullptr);
  if (QueryCuda().available) return;
  EXPECT_THROW(MakeCudaPhotoShader(0, 0), DeviceError);
}

// The order that the photographs are gone through, piece by piece, is that of all sorted at once.
TEST(PhotoOrder, IsThatOfTheAnglesWhateverTheirNumber) {
  for (const int photos : {0, 1, 7, 8, 9, 16, 17, 100}) {
    std::vector<PhotoCamera> cameras(static_cast<std::size_t>(photos));
    std::vector<std::uint32_t> candidates;
    std::vector<PhotoOrder::Direction> expected;
    const Vec3d to_viewer = Normalized(Vec3d{0.3, 1, 0.1});
    for (std::uint32_t i = 0; i < cameras.size(); ++i) {
      // Some equal, some behind the surface, some that cannot be read.
      const double angle = 0.37 * (i % 40);
      cameras[i].usable = i % 11 != 5;
      cameras[i].center = {std::sin(angle) * 2, std::cos(angle) * 2, 0.25};
      candidates.push_back(i);
      const Vec3d way = cameras[i].center;
      if (!cameras[i].usable || !(way.y > 0.05 * Length(way))) continue;
      expected.push_back({Dot(way, to_viewer) / Length(way), i});
    }
    std::ranges::sort(expected, [](const auto& a, const auto& b) { return a.IsBefore(b); });
    const PhotosView view{cameras.data(), nullptr, nullptr, candidates.data(),
                          static_cast<std::uint32_t>(candidates.size())};
    PhotoOrder order(view, {}, {0, 1, 0}, to_viewer);
    PhotoOrder::Direction next;
    for (const PhotoOrder::Direction& direction : expected) {
      ASSERT_TRUE(order.Next(&next)) << photos;
      EXPECT_EQ(next.photo, direction.photo) << photos;
    }
    EXPECT_FALSE(order.Next(&next)) << photos;
    EXPECT_FALSE(order.Next(&next)) << photos;
  }
}

}  // namespace
}  // namespace sherd
