// The options of the appearance, seen in the pictures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <OpenImageIO/imageio.h>

#include <cmath>

#include "app/cli/appearance_options.h"
#include "app/project/picture.h"
#include "metaball/error.h"
#include "tests/app/run_sherd.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

using cli::ParseColorRange;
using cli::ParseLight;
using testing::ExpectFailure;
using testing::RunResult;
using testing::RunSherd;

TEST(AppearanceOptions, Lights) {
  const Light sun = ParseLight("1,2,3");
  EXPECT_EQ(sun.kind, LightKind::kDirectional);
  EXPECT_EQ(sun.to_light, (Vec3d{1, 2, 3}));
  EXPECT_FALSE(sun.with_camera);
  EXPECT_EQ(ParseLight("sun:1,2,3@0.5").intensity, 0.5);
  const Light lamp = ParseLight("point:-1,0,2@1,0.5,0");
  EXPECT_EQ(lamp.kind, LightKind::kPoint);
  EXPECT_EQ(lamp.position, (Vec3d{-1, 0, 2}));
  EXPECT_EQ(lamp.color, (Vec3f{1, 0.5f, 0}));
  EXPECT_EQ(ParseLight("camera@2").kind, LightKind::kCamera);
  EXPECT_TRUE(ParseLight("camera-point:0,-1,0").with_camera);
  for (const char* bad : {"", "0,0,0", "sun:0,0,0", "lamp:1,2,3", "1,2", "point:", "camera@-1",
                          "camera@x", "point:1,2,3@1,2", "camera-point"}) {
    EXPECT_THROW(ParseLight(bad), InputError) << bad;
  }
}

TEST(AppearanceOptions, Ranges) {
  EXPECT_EQ(ParseColorRange("-1.5,2").lo, -1.5);
  EXPECT_EQ(ParseColorRange("-1.5,2").hi, 2);
  for (const char* bad : {"", "1", "2,1", "1,1", "1,2,3", "a,b"}) {
    EXPECT_THROW(ParseColorRange(bad), InputError) << bad;
  }
}

class CliAppearance : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::FreshFolder("appearance");
    // Two grey metaballs of radius 1, at (10, 0, 0) and, 3 to the right, at (13, 0, 0).
    testing::WriteText(folder_ + "/two.ply",
                       "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float "
                       "y\nproperty float z\nproperty float radius\nend_header\n10 0 0 1\n13 0 0 "
                       "1\n");
  }
  // From (10, -4, 0) towards the first one; sRGB bytes, three a pixel.
  std::vector<int> Render(const std::string& arguments) {
    const RunResult result = RunSherd("render '" + folder_ + "/two.ply' --out '" + folder_ +
                                      "/out.png' --size 101x81 --eye 10,-4,0 --look-at 10,0,0 "
                                      "--up 0,0,1 --fov-x 40 --threshold 0.25 " +
                                      arguments);
    EXPECT_EQ(result.code, 0) << result.err;
    std::vector<unsigned char> bytes(101 * 81 * 3);
    auto in = OIIO::ImageInput::open(folder_ + "/out.png");
    if (!in) {
      ADD_FAILURE() << OIIO::geterror();
    } else {
      EXPECT_EQ(in->spec().nchannels, 3);
      in->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, bytes.data());
    }
    return {bytes.begin(), bytes.end()};
  }
  static Vec3d At(const std::vector<int>& image, int x, int y) {
    const int* p = &image[static_cast<std::size_t>((y * 101 + x) * 3)];
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
  // A picture of two halves, left and right.
  std::string Halves(const Pixel& left, const Pixel& right) {
    Frame frame;
    frame.width = 8;
    frame.height = 4;
    for (int i = 0; i < 32; ++i) frame.color.push_back(i % 8 < 4 ? left : right);
    WritePicture(folder_ + "/halves.png", frame, {});
    return "'" + folder_ + "/halves.png'";
  }

  std::string folder_;
};

TEST_F(CliAppearance, ColourByAQuantityAndItsLegend) {
  const std::string by = "--unlit --color-by z --color-range -1,1 ";
  const std::vector<int> plain = Render(by);
  // z = 0 in the middle: the middle of viridis.
  EXPECT_LT(Length(At(plain, 50, 40) - Vec3d{33, 145, 140}), 8);
  EXPECT_GT(At(plain, 50, 20).x, At(plain, 50, 60).x);  // yellow above, violet below
  EXPECT_EQ(At(plain, 0, 0), (Vec3d{255, 255, 255}));
  const std::vector<int> grey = Render(by + "--color-map grey");
  EXPECT_LE(std::abs(At(grey, 50, 20).x - At(grey, 50, 20).y), 1);
  // The legend covers a part of the lower left and nothing else.
  const std::vector<int> with = Render("--background 0,0,1 --legend " + by);
  const std::vector<int> without = Render("--background 0,0,1 " + by);
  int changed = 0;
  for (int y = 0; y < 81; ++y) {
    for (int x = 0; x < 101; ++x) {
      if (At(with, x, y) == At(without, x, y)) continue;
      ++changed;
      EXPECT_LT(x, 60);
    }
  }
  EXPECT_GT(changed, 300);
}

TEST_F(CliAppearance, SpacingIsFoundWhereItIsAskedFor) {
  // Both metaballs are 3 apart: the middle of any map around 3.
  const std::vector<int> image = Render("--unlit --color-by spacing --color-range 2,4");
  EXPECT_LT(Length(At(image, 50, 40) - Vec3d{33, 145, 140}), 4);
}

TEST_F(CliAppearance, TexturesLieOnTheSurface) {
  const std::string halves = Halves({1, 0, 0, 1}, {0, 1, 0, 1});
  const std::string along = " --projection-along 0,1,0 --projection-up 0,0,1 ";
  // Both centres give the image's width: its left edge passes through x = 10, its middle 11.5.
  const std::vector<int> planar = Render("--unlit --texture " + halves + along);
  EXPECT_EQ(At(planar, 50, 40), (Vec3d{255, 0, 0}));
  const std::vector<int> thesis =
      Render("--unlit --texture-mode per-metaball --texture " + halves + along);
  EXPECT_EQ(At(thesis, 50, 40), (Vec3d{255, 0, 0}));
  // Around z through the middle between both: the first one's front shows the image's left half.
  const std::vector<int> cylinder =
      Render("--unlit --projection cylindrical --texture " + halves + along);
  EXPECT_EQ(At(cylinder, 50, 40), (Vec3d{255, 0, 0}));
}

TEST_F(CliAppearance, LightsShadowsAndFilter) {
  // The second one stands between the first and a light from the right.
  const std::string light = "--ambient 0.1 --diffuse 0.9 --light 1,0,0 ";
  const std::vector<int> lit = Render(light);
  const std::vector<int> shadowed = Render("--shadows " + light);
  EXPECT_GT(At(lit, 68, 40).x, At(shadowed, 68, 40).x + 60);
  const std::vector<int> both = Render("--light 1,0,0@1,0,0 --light -1,0,0@0,0,1 --ambient 0");
  EXPECT_GT(At(both, 68, 40).x, At(both, 68, 40).z + 60);
  EXPECT_GT(At(both, 33, 40).z, At(both, 33, 40).x + 60);
  const std::vector<int> sharp = Render("--unlit");
  const std::vector<int> soft = Render("--unlit --filter 11");
  EXPECT_EQ(At(sharp, 50, 40), At(soft, 50, 40));
  int between = 0;
  for (int x = 0; x < 101; ++x) between += At(soft, x, 40).x > 201 && At(soft, x, 40).x < 254;
  EXPECT_GE(between, 10);
}

TEST_F(CliAppearance, WhatCannotBeIsRefused) {
  const auto refused = [&](const std::string& arguments, const std::string& what) {
    ExpectFailure(
        RunSherd("render '" + folder_ + "/two.ply' --out '" + folder_ + "/no.png' " + arguments), 2,
        what);
  };
  refused("--color-by age", "no channel 'age'");
  refused("--color-by z --color-map jet", "jet");
  refused("--legend", "--color-by");
  refused("--filter 4", "odd");
  refused("--filter 13", "13");
  refused("--light moon:1,2,3", "moon");
  refused("--texture '" + folder_ + "/none.png'", "none.png");
  refused("--texture-mode surface", "--texture");
  refused("--ao-directions 8", "--ambient-occlusion");
  refused("--color-by normal --legend", "normals");
}

}  // namespace
}  // namespace sherd
