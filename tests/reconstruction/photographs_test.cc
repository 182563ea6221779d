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
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using test::TestFolder;
using ::testing::Contains;
using ::testing::HasSubstr;

using Painter = std::function<Rgb8(int x, int y)>;

void WritePpm(const std::string& path, int width, int height, const Painter& paint) {
  std::string bytes = "P6\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Rgb8 c = paint(x, y);
      bytes.push_back(static_cast<char>(c.r));
      bytes.push_back(static_cast<char>(c.g));
      bytes.push_back(static_cast<char>(c.b));
    }
  }
  test::WriteFile(path, bytes);
}

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
  const PhotoPyramid all = PhotoPyramid::Read(path, 0);
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
  const PhotoPyramid coarse = PhotoPyramid::Read(path, 1);
  EXPECT_EQ(coarse.finest(), 1);
  EXPECT_EQ(coarse.width(), 5);
  ASSERT_EQ(coarse.levels().size(), 3u);
  EXPECT_EQ(coarse.levels()[0].pixels, all.levels()[1].pixels);
  EXPECT_LT(coarse.MemoryBytes(), all.MemoryBytes());
  EXPECT_EQ(PhotoPyramid::BytesFor(5, 3, 0), (15u + 6 + 2 + 1) * 3);
  EXPECT_EQ(PhotoPyramid::Read(path, 30).levels().size(), 1u);
}

TEST(Pyramid, PixelCentresAreAtOneHalf) {
  const std::string path = TestFolder() + "/a.ppm";
  WritePpm(path, 4, 4, [](int x, int y) {
    return Rgb8{static_cast<std::uint8_t>(60 * x), static_cast<std::uint8_t>(60 * y), 0};
  });
  const PhotoPyramid p = PhotoPyramid::Read(path, 0);
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

// --- on the surface ---

// A board at z = 4 painted with stripes far finer than the metaballs, photographed by lenses with
// distortion.
Vec3f BoardColor(const Vec3d& p) {
  const double stripes =
      0.5 + 0.4 * std::sin(2 * M_PI * p.x / 0.03) * std::sin(2 * M_PI * p.y / 0.04);
  return Vec3d{stripes, 0.5 + 0.3 * std::sin(3 * p.x), 0.2 + 0.1 * p.y}.cast<float>();
}

struct Board {
  std::string folder = TestFolder();
  Survey survey;
  Level level;

  // scale: file pixels per camera pixel. shift: pixels by which the pictures lie right and down of
  // where the camera says.
  explicit Board(double scale = 1, double shift = 0, int photos = 3) {
    survey.cameras.push_back({1, CameraModelId::kSimpleRadial, 800, 600, {700, 400, 300, -0.15}});
    for (int i = 0; i < photos; ++i) {
      Photograph photo;
      photo.name = std::to_string(i) + ".ppm";
      photo.path = folder + "/" + photo.name;
      photo.cam_from_world = test::PoseAt({-0.5 + 0.5 * i, 0, 0}, 0.1 * (1 - i));
      survey.photographs.push_back(photo);
      const SurveyCamera& camera = survey.cameras[0];
      const Rigid3d& pose = photo.cam_from_world;
      WritePpm(photo.path, static_cast<int>(800 * scale), static_cast<int>(600 * scale),
               [&](int x, int y) {
                 // The board point this pixel shows: Newton by fixed point on the distortion.
                 const double px = (x + 0.5) / scale - shift, py = (y + 0.5) / scale - shift;
                 const double u0 = (px - 400) / 700, v0 = (py - 300) / 700;
                 double u = u0, v = v0;
                 for (int k = 0; k < 30; ++k) {
                   const double f = 1 + camera.parameters[3] * (u * u + v * v);
                   u = u0 / f;
                   v = v0 / f;
                 }
                 const Vec3d direction = pose.InverseRotate({u, v, 1});
                 const Vec3d eye = pose.Center();
                 const Vec3d p = eye + direction * ((4 - eye.z) / direction.z);
                 return Rgb8FromLinear(BoardColor(p));
               });
    }
    survey.points.photo_begin.push_back(0);
    for (int i = 0; i < 60; ++i) {
      for (int j = 0; j < 45; ++j) {
        survey.points.position.push_back({-1.5 + 0.05 * i, -1.1 + 0.05 * j, 4});
        survey.points.normal.push_back({0, 0, -1});
        survey.points.color.push_back({10, 200, 30});
        for (int k = 0; k < photos; ++k) survey.points.photo_idx.push_back(k);
        survey.points.photo_begin.push_back(survey.points.photo_idx.size());
      }
    }
    Build();
  }

  void Build() {
    LevelOptions options;
    options.target_count = survey.points.size();
    level = BuildLevel(PreparePoints(survey, false), survey, options);
  }

  static Camera View() {
    return Camera::LookAt({0.2, 0.1, 1.2}, {0.05, 0, 4}, {0, -1, 0}, 0.5, 400, 300);
  }

  Frame Render(const Camera& camera) const {
    Scene scene;
    scene.cloud = std::make_shared<Cloud>(level.cloud);
    scene.lighting.unlit = true;
    RenderSettings settings;
    settings.planes = {true, true, true};
    return MakeCpuRenderer()->Render(scene, camera, settings);
  }

  // Root mean square difference of the middle of the picture to the painted board, linear light.
  static double Difference(const Frame& frame, const Camera& camera) {
    double sum = 0;
    int n = 0;
    for (int y = 40; y < frame.height - 40; ++y) {
      for (int x = 40; x < frame.width - 40; ++x) {
        const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
        const Vec3f truth =
            BoardColor(ray.origin + ray.direction * ((4 - ray.origin.z) / ray.direction.z));
        const Pixel& c = frame.color[static_cast<std::size_t>(y) * frame.width + x];
        const Vec3f d{c.r - truth.x, c.g - truth.y, c.b - truth.z};
        sum += Dot(d, d) / 3;
        ++n;
      }
    }
    return std::sqrt(sum / n);
  }
};

TEST(Shading, DetailFarFinerThanTheMetaballsIsThere) {
  const Board board;
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  EXPECT_GT(Board::Difference(frame, camera), 0.15) << "one colour a metaball shows no stripes";
  PhotographShader shader(board.survey);
  Lighting unlit;
  unlit.unlit = true;
  const PhotoShadingStats stats = shader.Shade(board.level, camera, unlit, &frame);
  EXPECT_LT(Board::Difference(frame, camera), 0.03);
  EXPECT_EQ(stats.pixels, 400u * 300);
  EXPECT_EQ(stats.from_photos, stats.pixels);
  EXPECT_EQ(stats.without_photo, 0u);
  EXPECT_EQ(stats.photos_used, 3u);
  EXPECT_TRUE(stats.warnings.empty());
  // Once more, from what is held, the same.
  Frame again = board.Render(camera);
  shader.Shade(board.level, camera, unlit, &again);
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    ASSERT_EQ(frame.color[i].r, again.color[i].r);
  }
}

TEST(Shading, AResizedFileIsScaled) {
  const Board board(1.5);
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  Lighting unlit;
  unlit.unlit = true;
  PhotographShader(board.survey).Shade(board.level, camera, unlit, &frame);
  EXPECT_LT(Board::Difference(frame, camera), 0.03);
}

TEST(Shading, TheDensePixelOffsetIsApplied) {
  Board board(1, 3.0);
  const Camera camera = Board::View();
  Lighting unlit;
  unlit.unlit = true;
  Frame without = board.Render(camera), with = without;
  PhotographShader(board.survey).Shade(board.level, camera, unlit, &without);
  board.survey.dense_pixel_offset = 3.0;
  PhotographShader(board.survey).Shade(board.level, camera, unlit, &with);
  EXPECT_GT(Board::Difference(without, camera), 0.06);
  EXPECT_LT(Board::Difference(with, camera), 0.03);
}

TEST(Shading, LightIsAppliedToThePhotographs) {
  const Board board;
  const Camera camera = Board::View();
  Frame lit = board.Render(camera), plain = lit;
  Lighting unlit, half;
  unlit.unlit = true;
  half.ambient = 0.5;
  half.diffuse = 0;
  PhotographShader shader(board.survey);
  shader.Shade(board.level, camera, unlit, &plain);
  shader.Shade(board.level, camera, half, &lit);
  for (std::size_t i = 0; i < lit.color.size(); i += 97) {
    EXPECT_NEAR(lit.color[i].r, plain.color[i].r / 2, 1e-5);
  }
}

TEST(Shading, PlacesNoPhotographSeesKeepTheirColour) {
  Board board;
  // The right half is listed for none.
  SurveyPoints& points = board.survey.points;
  points.photo_begin = {0};
  points.photo_idx.clear();
  for (const Vec3d& p : points.position) {
    if (p.x < 0) points.photo_idx.push_back(1);
    points.photo_begin.push_back(points.photo_idx.size());
  }
  board.Build();
  const Camera camera = Board::View();
  const Frame before = board.Render(camera);
  Frame frame = before;
  Lighting unlit;
  unlit.unlit = true;
  const PhotoShadingStats stats =
      PhotographShader(board.survey).Shade(board.level, camera, unlit, &frame);
  EXPECT_GT(stats.without_photo, 10000u);
  EXPECT_GT(stats.from_photos, 10000u);
  EXPECT_EQ(stats.without_photo + stats.from_photos, stats.pixels);
  EXPECT_EQ(stats.photos_used, 1u);
  std::uint64_t kept = 0;
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    kept += frame.color[i].r == before.color[i].r && frame.color[i].g == before.color[i].g;
  }
  EXPECT_EQ(kept, stats.without_photo);
}

TEST(Shading, PhotographsThatCannotBeReadAreCountedAndTheOthersUsed) {
  Board board;
  board.survey.photographs[0].path = board.folder + "/none.ppm";
  test::WriteFile(board.survey.photographs[2].path, "P6\n800 600\n255\ncut off");
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  Lighting unlit;
  unlit.unlit = true;
  PhotographShader shader(board.survey);
  const PhotoShadingStats stats = shader.Shade(board.level, camera, unlit, &frame);
  EXPECT_EQ(stats.photos_unreadable, 2u);
  EXPECT_EQ(stats.photos_used, 1u);
  EXPECT_THAT(stats.warnings, Contains(HasSubstr("2 photographs could not be used")));
  EXPECT_LT(Board::Difference(frame, camera), 0.05);
}

TEST(Shading, NeedsItsPlanesAndSaysWhenNothingIsKnown) {
  Board board;
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  Frame bare = frame;
  bare.id.clear();
  PhotographShader shader(board.survey);
  EXPECT_THROW(shader.Shade(board.level, camera, {}, &bare), Error);
  board.level.photo_begin.clear();
  board.level.photo_idx.clear();
  const PhotoShadingStats stats = shader.Shade(board.level, camera, {}, &frame);
  EXPECT_EQ(stats.from_photos, 0u);
  EXPECT_EQ(stats.without_photo, stats.pixels);
  EXPECT_EQ(stats.warnings.size(), 1u);
}

TEST(Shading, ASmallBudgetGivesThePictureToo) {
  const Board board;
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  Lighting unlit;
  unlit.unlit = true;
  PhotographShader shader(board.survey, 2);  // one photograph of three at a time
  const PhotoShadingStats stats = shader.Shade(board.level, camera, unlit, &frame);
  EXPECT_EQ(stats.photos_used, 3u);
  EXPECT_LT(Board::Difference(frame, camera), 0.03);
}

TEST(Shading, CanBeCancelled) {
  const Board board;
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  std::stop_source source;
  source.request_stop();
  Control control;
  control.stop = source.get_token();
  EXPECT_THROW(PhotographShader(board.survey).Shade(board.level, camera, {}, &frame, control),
               Cancelled);
}

}  // namespace
}  // namespace sherd
