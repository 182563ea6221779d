// Photographs as pixels and on the surface.
#include "reconstruction/photographs.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "metaball/error.h"
#include "metaball/renderer.h"
#include "reconstruction/photo_pyramid.h"
#include "reconstruction/photo_store.h"
#include "tests/reconstruction/photo_board.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using test::TestFolder;
using test::WritePpm;

TEST(Pyramid, EncodesEveryByteAsItself) {
  for (int i = 0; i < 256; ++i) {
    EXPECT_EQ(EncodeLinear(SrgbToLinearTable()[i]), i);
  }
  EXPECT_EQ(EncodeLinear(-1), 0);
  EXPECT_EQ(EncodeLinear(NAN), 0);
  EXPECT_EQ(EncodeLinear(2), 255);
}

TEST(Pyramid, HalvesInLinearLightDownToOnePixel) {
  const std::string path = TestFolder() + "/a.ppm";
  WritePpm(path, 5, 3, [](int x, int y) {
    return Rgb8{static_cast<std::uint8_t>((x + y) % 2 ? 255 : 0), 77,
                static_cast<std::uint8_t>(x * 10)};
  });
  const PhotoPyramid all = ReadPhotoPyramid(path, 0);
  EXPECT_EQ(all.width(), 5);
  EXPECT_EQ(all.height(), 3);
  ASSERT_EQ(all.levels().size(), 4u);
  EXPECT_EQ(all.levels()[1].width, 3);
  EXPECT_EQ(all.levels()[1].height, 2);
  EXPECT_EQ(all.levels()[3].width, 1);
  EXPECT_EQ(all.levels()[3].pixels.size(), 1u);
  EXPECT_NEAR(all.levels()[1].pixels[0].r, 188, 1);
  EXPECT_EQ(all.levels()[1].pixels[0].b, EncodeLinear(SrgbToLinearTable()[10] / 2));
  for (const PhotoLevel& level : all.levels()) {
    ASSERT_EQ(level.pixels.size(), static_cast<std::size_t>(level.width) * level.height);
    for (const Rgb8& c : level.pixels) EXPECT_EQ(c.g, 77);
  }
  // Without the fine levels the coarse ones are the same.
  const PhotoPyramid coarse = ReadPhotoPyramid(path, 1);
  EXPECT_EQ(coarse.finest(), 1);
  EXPECT_EQ(coarse.width(), 5);
  ASSERT_EQ(coarse.levels().size(), 3u);
  EXPECT_EQ(coarse.levels()[0].pixels, all.levels()[1].pixels);
  EXPECT_LT(coarse.MemoryBytes(), all.MemoryBytes());
  EXPECT_EQ(PhotoPyramid::BytesFor(5, 3, 0), (15u + 6 + 2 + 1) * 3);
  EXPECT_EQ(ReadPhotoPyramid(path, 30).levels().size(), 1u);
}

TEST(Pyramid, PixelCentresAreAtOneHalf) {
  const std::string path = TestFolder() + "/a.ppm";
  WritePpm(path, 4, 4, [](int x, int y) {
    return Rgb8{static_cast<std::uint8_t>(60 * x), static_cast<std::uint8_t>(60 * y), 0};
  });
  const PhotoPyramid p = ReadPhotoPyramid(path, 0);
  const float* const linear = SrgbToLinearTable();
  EXPECT_FLOAT_EQ(p.Sample(2.5f, 1.5f, 0).x, linear[120]);
  EXPECT_FLOAT_EQ(p.Sample(2.5f, 1.5f, 0).y, linear[60]);
  EXPECT_FLOAT_EQ(p.Sample(2.0f, 1.5f, 0).x, (linear[60] + linear[120]) / 2);
  EXPECT_FLOAT_EQ(p.Sample(-5, 99, 0).x, 0) << "clamped to the border";
  EXPECT_FLOAT_EQ(p.Sample(-5, 99, 0).y, linear[180]);
  EXPECT_FLOAT_EQ(p.Sample(2.5f, 1.5f, -3).x, linear[120]);
  const Vec3f top = p.Sample(1, 1, 99);
  EXPECT_FLOAT_EQ(p.Sample(3, 2, 99).x, top.x) << "the last level is one pixel";
}

TEST(Pyramid, TheCubicMeetsThePixelsAndKeepsRamps) {
  const std::string path = TestFolder() + "/a.ppm";
  WritePpm(path, 8, 8, [](int x, int y) {
    return Rgb8FromLinear(
        {0.1f + 0.1f * static_cast<float>(x), 0.1f * static_cast<float>(y), x == 4 ? 1.0f : 0.0f});
  });
  const PhotoPyramid p = ReadPhotoPyramid(path, 0);
  const Vec3f at = p.SampleSharply(3.5f, 2.5f, 0), stored = p.Sample(3.5f, 2.5f, 0);
  EXPECT_FLOAT_EQ(at.x, stored.x);
  EXPECT_FLOAT_EQ(at.z, stored.z);
  EXPECT_NEAR(p.SampleSharply(3.8f, 4.3f, 0).x, 0.43f, 0.005f) << "a ramp stays one";
  EXPECT_NEAR(p.SampleSharply(3.8f, 4.3f, 0).y, 0.38f, 0.005f);
  EXPECT_EQ(p.SampleSharply(3.1f, 4, 0).z, 0.0f) << "never negative beside a bright line";
  EXPECT_GT(p.SampleSharply(4.5f, 4, 0).z, 0.99f);
}

TEST(Photo, IsNotTurnedByExif) {
  const std::string path = TestFolder() + "/turned.jpg";
  OIIO::ImageSpec spec(32, 16, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Orientation", 6);
  spec.attribute("CompressionQuality", 100);
  const auto out = OIIO::ImageOutput::create(path);
  ASSERT_TRUE(out);
  std::vector<std::uint8_t> pixels(32 * 16 * 3);
  for (int i = 0; i < 32 * 16; ++i) pixels[3 * i] = i % 32 < 16 ? 200 : 20;
  ASSERT_TRUE(out->open(path, spec));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, pixels.data()));
  out->close();
  EXPECT_EQ(ReadPhotoSize(path).width, 32);
  EXPECT_EQ(ReadPhotoSize(path).height, 16);
  const PhotoImage photo = ReadPhoto(path);
  ASSERT_EQ(photo.pixels.size(), 512u);
  EXPECT_NEAR(photo.pixels[5].r, 200, 12);
  EXPECT_NEAR(photo.pixels[27].r, 20, 12);
}

TEST(Photo, GreyAlphaAndTiledFiles) {
  const std::string folder = TestFolder();
  struct Kind {
    const char* name;
    int channels;
    int tile;
  };
  for (const Kind& kind : {Kind{"grey.png", 1, 0}, Kind{"alpha.png", 4, 0},
                           Kind{"tiled.tif", 3, 16}, Kind{"grey_alpha.png", 2, 0}}) {
    const std::string path = folder + "/" + kind.name;
    OIIO::ImageSpec spec(40, 24, kind.channels, OIIO::TypeDesc::UINT8);
    spec.tile_width = spec.tile_height = kind.tile;
    std::vector<std::uint8_t> pixels(40 * 24 * kind.channels, 255);
    for (int i = 0; i < 40 * 24; ++i) {
      pixels[i * kind.channels] = static_cast<std::uint8_t>(i % 40 * 5);
    }
    const auto out = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(out && out->open(path, spec)) << kind.name;
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, pixels.data()));
    out->close();
    const PhotoImage photo = ReadPhoto(path);
    ASSERT_EQ(photo.width, 40) << kind.name;
    for (int i = 0; i < 40 * 24; ++i) {
      ASSERT_EQ(photo.pixels[i].r, i % 40 * 5) << kind.name;
      ASSERT_EQ(photo.pixels[i].b, kind.channels < 3 ? i % 40 * 5 : 255) << kind.name;
    }
  }
}

TEST(Photo, ReducedByAreaInLinearLight) {
  const std::string path = TestFolder() + "/a.ppm";
  WritePpm(path, 90, 45, [](int x, int y) {
    return Rgb8{static_cast<std::uint8_t>((x + y) % 2 ? 255 : 0), 77,
                static_cast<std::uint8_t>(x < 45 ? 0 : 255)};
  });
  const PhotoImage photo = ReadPhoto(path, 20);
  EXPECT_EQ(photo.width, 20);
  EXPECT_EQ(photo.height, 10);
  ASSERT_EQ(photo.pixels.size(), 200u);
  for (std::size_t i = 0; i < photo.pixels.size(); ++i) {
    EXPECT_NEAR(photo.pixels[i].r, 188, 4);
    EXPECT_EQ(photo.pixels[i].g, 77);
    EXPECT_EQ(photo.pixels[i].b, i % 20 < 10 ? 0 : 255);
  }
  EXPECT_EQ(ReadPhoto(path, 90).pixels.size(), 90u * 45);
  EXPECT_EQ(ReadPhoto(path, 1).pixels.size(), 1u);
}

TEST(Photo, WhatIsNoImageSaysSo) {
  const std::string folder = TestFolder();
  test::WriteFile(folder + "/a.jpg", "no picture at all");
  EXPECT_THROW(ReadPhotoSize(folder + "/a.jpg"), InputError);
  EXPECT_THROW(ReadPhotoSize(folder + "/none.jpg"), InputError);
  // Cut off at every byte.
  WritePpm(folder + "/b.ppm", 8, 8, [](int, int) { return Rgb8{}; });
  const std::string whole = test::ReadFile(folder + "/b.ppm");
  for (std::size_t length = 0; length < whole.size(); ++length) {
    test::WriteFile(folder + "/b.ppm", whole.substr(0, length));
    try {
      EXPECT_EQ(ReadPhoto(folder + "/b.ppm").pixels.size(), 64u);
    } catch (const InputError&) {
    }
  }
}

TEST(PhotoStoreTest, KeepsToItsBound) {
  const std::string folder = TestFolder();
  std::vector<PhotoStore::Request> requests;
  for (int i = 0; i < 6; ++i) {
    const std::string path = folder + "/" + std::to_string(i) + ".ppm";
    WritePpm(path, 64, 64, [&](int, int) { return Rgb8{static_cast<std::uint8_t>(i), 0, 0}; });
    requests.push_back({path, 64, 64, 0});
  }
  const std::size_t one = PhotoPyramid::BytesFor(64, 64, 0);
  PhotoStore store(2 * one + 100);
  std::vector<std::string> problems;
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < requests.size();) {
      const auto got = store.Fetch(requests, i, {}, &problems);
      ASSERT_EQ(got.size(), 2u);
      for (const auto& pyramid : got) {
        ASSERT_TRUE(pyramid);
        EXPECT_EQ(pyramid->levels()[0].pixels[0].r, i++);
      }
      EXPECT_LE(store.MemoryBytes(), 2 * one + 100);
    }
  }
  PhotoStore tiny(one / 3);  // one alone does not fit: it comes coarser
  const auto got = tiny.Fetch(requests, 0, {}, &problems);
  ASSERT_EQ(got.size(), 1u);
  EXPECT_EQ(got[0]->finest(), 1);
  EXPECT_TRUE(problems.empty());
  requests[0].path = folder + "/none.ppm";
  EXPECT_FALSE(store.Fetch(requests, 0, {}, &problems)[0]);
  EXPECT_EQ(problems.size(), 1u);
}

TEST(CameraOfPhoto, SeesWhatThePhotographSees) {
  Survey s;
  s.cameras.push_back({1, CameraModelId::kPinhole, 640, 480, {500, 510, 310, 245}});
  Photograph photo;
  photo.cam_from_world = test::PoseAt({1, 2, 3}, 0.4);
  s.photographs.push_back(photo);
  const Camera own = CameraOfPhotograph(s, 0);
  EXPECT_EQ(own.width, 640);
  const Camera half = CameraOfPhotograph(s, 0, 320, 0);
  EXPECT_EQ(half.height, 240);
  const Camera stretched = CameraOfPhotograph(s, 0, 640, 240);
  for (const Vec3d& p : {Vec3d{1, 2, 9}, Vec3d{-1, 3, 8}, Vec3d{0, 1, 7}}) {
    const auto expected = s.cameras[0].Project(photo.cam_from_world.Apply(p));
    ASSERT_TRUE(expected);
    double x, y;
    ASSERT_TRUE(own.Project(p, &x, &y));
    EXPECT_NEAR(x, expected->first, 1e-9);
    EXPECT_NEAR(y, expected->second, 1e-9);
    ASSERT_TRUE(half.Project(p, &x, &y));
    EXPECT_NEAR(x, expected->first / 2, 1e-9);
    ASSERT_TRUE(stretched.Project(p, &x, &y));
    EXPECT_NEAR(x, expected->first, 1e-9);
    EXPECT_NEAR(y, expected->second / 2, 1e-9);
  }
  EXPECT_THROW(CameraOfPhotograph(s, 1), Error);
}

}  // namespace
}  // namespace sherd
