// sherd render: every option does what it says, seen in the pictures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <OpenImageIO/imageio.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/project/picture.h"
#include "metaball/color.h"
#include "metaball/metaball_file.h"
#include "tests/app/run_sherd.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using testing::RunResult;
using testing::RunSherd;

struct Image {
  int width = 0, height = 0, channels = 0;
  std::vector<float> v;
  float At(int x, int y, int c) const {
    return v[static_cast<std::size_t>((y * width + x) * channels + c)];
  }
};

Image Read(const std::string& path) {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  auto in = OIIO::ImageInput::open(path, &config);
  Image image;
  if (!in) {
    ADD_FAILURE() << path << ": " << OIIO::geterror();
    return image;
  }
  image.width = in->spec().width;
  image.height = in->spec().height;
  image.channels = in->spec().nchannels;
  image.v.resize(static_cast<std::size_t>(image.width * image.height * image.channels));
  in->read_image(0, 0, 0, image.channels, OIIO::TypeDesc::FLOAT, image.v.data());
  return image;
}

class CliRender : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::FreshFolder("render");
    // One grey metaball of radius 1 at (10, 0, 0) in a .ply; at threshold 0.25 the surface is the
    // sphere of radius sqrt(1/2).
    testing::WriteText(folder_ + "/one.ply",
                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                       "y\nproperty float z\nproperty float radius\nproperty uchar red\nproperty "
                       "uchar green\nproperty uchar blue\nend_header\n10 0 0 1 188 100 50\n");
  }
  RunResult Render(const std::string& arguments, const std::string& source = "one.ply") {
    return RunSherd("render '" + folder_ + "/" + source + "' --out '" + folder_ + "/out.png' " +
                    arguments);
  }
  // From (10, -4, 0) towards the metaball, the field of view such that it fills a good part.
  RunResult RenderFront(const std::string& arguments) {
    return Render(std::string("--size 101x81 --eye 10,-4,0 --look-at 10,0,0 --up 0,0,1 --fov-x 40 "
                              "--threshold 0.25 ") +
                  arguments);
  }
  Image Picture() { return Read(folder_ + "/out.png"); }

  std::string folder_;
  const double surface_radius_ = std::sqrt(0.5);
};

TEST_F(CliRender, DepthIsTheDistanceAlongTheRay) {
  const RunResult result = RenderFront("--depth-out '" + folder_ + "/d.exr'");
  ASSERT_EQ(result.code, 0) << result.err;
  const Image depth = Read(folder_ + "/d.exr");
  ASSERT_EQ(depth.channels, 1);
  ASSERT_EQ(depth.width, 101);
  const double f = 0.5 * 101 / std::tan(20 * M_PI / 180);
  int hits = 0;
  for (int y = 0; y < 81; ++y) {
    for (int x = 0; x < 101; ++x) {
      // A sphere at distance 4 along +y; x right is +x, down is -z.
      const double u = (x + 0.5 - 50.5) / f, w = (y + 0.5 - 40.5) / f;
      const double b = 4 / std::sqrt(1 + u * u + w * w);
      const double disc = b * b - 16 + surface_radius_ * surface_radius_;
      if (std::abs(disc) < 1e-3) continue;  // grazing
      const float found = depth.At(x, y, 0);
      if (disc < 0) {
        EXPECT_EQ(found, 0) << x << " " << y;
      } else {
        EXPECT_NEAR(found, b - std::sqrt(disc), 1e-4) << x << " " << y;
        ++hits;
      }
    }
  }
  EXPECT_GT(hits, 500);
}

TEST_F(CliRender, UnlitColourIsTheInputsSrgb) {
  ASSERT_EQ(RenderFront("--unlit").code, 0);
  const Image image = Picture();
  EXPECT_NEAR(image.At(50, 40, 0) * 255, 188, 1);
  EXPECT_NEAR(image.At(50, 40, 1) * 255, 100, 1);
  EXPECT_NEAR(image.At(50, 40, 2) * 255, 50, 1);
  EXPECT_EQ(image.At(0, 0, 0), 1);  // white background
}

TEST_F(CliRender, LinearWritesLinearValuesAndBackground) {
  ASSERT_EQ(RenderFront("--unlit --linear --background 0.5,0,1").code, 0);
  const Image image = Picture();
  EXPECT_NEAR(image.At(50, 40, 0), LinearFromSrgb(188 / 255.0f), 1.0 / 255);
  EXPECT_NEAR(image.At(50, 40, 2), LinearFromSrgb(50 / 255.0f), 1.0 / 255);
  EXPECT_NEAR(image.At(0, 0, 0), LinearFromSrgb(0.5f), 1.0 / 255);
  EXPECT_EQ(image.At(0, 0, 2), 1);
}

TEST_F(CliRender, LightFollowsTheThesis) {
  // C (amb + diff max(0, n.l)), the light towards (0, -1, 0): the middle faces it.
  ASSERT_EQ(RenderFront("--linear --ambient 0.2 --diffuse 0.5 --light 0,-3,0").code, 0);
  Image image = Picture();
  const float c = LinearFromSrgb(188 / 255.0f);
  EXPECT_NEAR(image.At(50, 40, 0), 0.7f * c, 1.5 / 255);
  // From behind: ambient alone.
  ASSERT_EQ(RenderFront("--linear --ambient 0.2 --diffuse 0.5 --light 0,1,0").code, 0);
  image = Picture();
  EXPECT_NEAR(image.At(50, 40, 0), 0.2f * c, 1.5 / 255);
  // From the right: lighter there.
  ASSERT_EQ(RenderFront("--light 1,0,0").code, 0);
  image = Picture();
  EXPECT_GT(image.At(70, 40, 0), image.At(31, 40, 0) + 0.15f);
  // Never above 1.
  ASSERT_EQ(RenderFront("--ambient 9").code, 0);
  EXPECT_EQ(Picture().At(50, 40, 0), 1);
}

TEST_F(CliRender, TransparentBackgroundHasAlpha) {
  ASSERT_EQ(RenderFront("--background transparent").code, 0);
  Image image = Picture();
  ASSERT_EQ(image.channels, 4);
  EXPECT_EQ(image.At(0, 0, 3), 0);
  EXPECT_EQ(image.At(50, 40, 3), 1);
  ASSERT_EQ(RenderFront("--background transparent --supersample 3").code, 0);
  image = Picture();
  int edge = 0;
  for (int x = 0; x < 101; ++x) edge += image.At(x, 40, 3) > 0.05f && image.At(x, 40, 3) < 0.95f;
  EXPECT_GE(edge, 1);
  EXPECT_LE(edge, 4);
}

TEST_F(CliRender, OrthographicWidthAndRadiusScale) {
  const auto width_of = [this] {
    const Image depth = Read(folder_ + "/d.exr");
    int hits = 0;
    for (int x = 0; x < depth.width; ++x) hits += depth.At(x, depth.height / 2, 0) > 0;
    return hits;
  };
  const std::string view =
      "--size 200x100 --eye 10,-4,0 --look-at 10,0,0 --ortho-width 4 "
      "--threshold 0.25 --depth-out '" +
      folder_ + "/d.exr' ";
  ASSERT_EQ(Render(view).code, 0);
  EXPECT_NEAR(width_of(), 2 * surface_radius_ * 50, 2);
  ASSERT_EQ(Render(view + "--radius-scale 0.5").code, 0);
  EXPECT_NEAR(width_of(), surface_radius_ * 50, 2);
}

TEST_F(CliRender, DefaultViewFitsTheCloud) {
  testing::WritePly(folder_ + "/wavy.ply", 2500);
  for (const char* view : {"", "--view top", "--view iso --ortho", "--view front"}) {
    const RunResult result = Render(std::string("--size 160x120 --json ") + view, "wavy.ply");
    ASSERT_EQ(result.code, 0) << result.err;
    const json stats = json::parse(result.out);
    EXPECT_GT(stats["hits"], 160 * 120 / 20) << view;
    EXPECT_LT(stats["hits"], 160 * 120) << view;
    EXPECT_EQ(stats["rare_events"]["rays_started_inside"], 0) << view;
  }
}

TEST_F(CliRender, StatsHoldEverythingThatWasCounted) {
  const RunResult result = RenderFront("--stats '" + folder_ + "/s.json'");
  ASSERT_EQ(result.code, 0) << result.err;
  const json stats = json::parse(testing::ReadText(folder_ + "/s.json"));
  EXPECT_EQ(stats["metaballs"], 1);
  EXPECT_EQ(stats["metaballs_in_view"], 1);
  EXPECT_EQ(stats["rays"], 101 * 81);
  EXPECT_GT(stats["hits"], 500);
  for (const char* event : {"rays_started_inside", "grazing", "unresolved", "metaballs_dropped"}) {
    EXPECT_TRUE(stats["rare_events"].contains(event)) << event;
  }
  for (const char* stage : {"load", "prepare", "bin", "trace", "write", "total"}) {
    EXPECT_TRUE(stats["seconds"][stage].is_number()) << stage;
  }
  EXPECT_GT(stats["peak_memory_bytes"], 1 << 20);
  EXPECT_TRUE(stats["backend"] == "cpu" || stats["backend"] == "cuda");
  EXPECT_FALSE(stats["device"].get<std::string>().empty());
  // A camera inside the surface.
  const RunResult inside =
      Render("--size 20x20 --eye 10,0,0 --look-at 10,1,0 --threshold 0.25 --json");
  EXPECT_EQ(json::parse(inside.out)["rare_events"]["rays_started_inside"], 400);
}

TEST_F(CliRender, ReferenceDecidesTheExitCode) {
  ASSERT_EQ(RenderFront("").code, 0);
  fs::rename(folder_ + "/out.png", folder_ + "/reference.png");
  const std::string reference = "--reference '" + folder_ + "/reference.png' ";
  RunResult result = RenderFront(reference + "--reference-threshold 0");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("difference from"));
  result = RenderFront("--radius-scale 1.3 " + reference + "--reference-threshold 0.5");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.err, HasSubstr("sherd: "));
  EXPECT_THAT(result.err, HasSubstr("more than 0.5"));
  EXPECT_EQ(RenderFront("--radius-scale 1.3 " + reference + "--reference-threshold 255").code, 0);
  const json stats = json::parse(RenderFront(reference + "--json").out);
  EXPECT_EQ(stats["reference"]["rms"], 0);
  EXPECT_EQ(stats["reference"]["passed"], true);
}

TEST_F(CliRender, MetadataNameTheSourceAndTheCamera) {
  ASSERT_EQ(RenderFront("--dpi 300").code, 0);
  auto in = OIIO::ImageInput::open(folder_ + "/out.png");
  ASSERT_TRUE(in);
  EXPECT_EQ(in->spec().get_string_attribute("sherd:source"), "one.ply");
  EXPECT_EQ(in->spec().get_string_attribute("sherd:metaballs"), "1");
  EXPECT_EQ(in->spec().get_string_attribute("sherd:threshold"), "0.25");
  EXPECT_THAT(in->spec().get_string_attribute("sherd:camera"), HasSubstr("eye 10,-4,0"));
  EXPECT_THAT(in->spec().get_string_attribute("Software"), HasSubstr("Sherd"));
  EXPECT_NEAR(in->spec().get_float_attribute("XResolution"), 300, 0.5);
}

TEST_F(CliRender, SixteenBitsAndOtherFormats) {
  for (const char* name : {"a.tif", "a.exr", "a.jpg", "a.PNG"}) {
    const RunResult result = RunSherd("render '" + folder_ + "/one.ply' --size 40x30 --out '" +
                                      folder_ + "/" + name + "'");
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_EQ(Read(folder_ + "/" + name).width, 40);
  }
  ASSERT_EQ(RenderFront("--bits 16").code, 0);
  auto in = OIIO::ImageInput::open(folder_ + "/out.png");
  ASSERT_TRUE(in);
  EXPECT_EQ(in->spec().format, OIIO::TypeDesc::UINT16);
}

TEST_F(CliRender, PlyFieldsThatAreMissingGetDefaults) {
  // No radius, no colour; a float colour is linear.
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 400\nproperty float x\nproperty float "
      "y\nproperty float z\nend_header\n";
  for (int i = 0; i < 400; ++i) {
    text += std::to_string(0.1 * (i % 20)) + " " + std::to_string(0.1 * (i / 20)) + " 0\n";
  }
  testing::WriteText(folder_ + "/bare.ply", text);
  RunResult result = Render("--view top --unlit --size 64x64 --json", "bare.ply");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_GT(json::parse(result.out)["hits"], 64 * 64 / 2);  // closed
  const Image image = Picture();
  EXPECT_NEAR(image.At(32, 32, 0) * 255, 200, 1);

  testing::WriteText(folder_ + "/float.ply",
                     "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                     "y\nproperty float z\nproperty float radius\nproperty float red\nproperty "
                     "float green\nproperty float blue\nend_header\n0 0 0 1 0.5 1 0\n");
  ASSERT_EQ(Render("--view top --unlit --size 32x32", "float.ply").code, 0);
  EXPECT_NEAR(Picture().At(16, 16, 0), SrgbFromLinear(0.5f), 1.0 / 255);
  EXPECT_NEAR(Picture().At(16, 16, 1), 1, 1.0 / 255);

  // Metaballs that cannot be drawn are counted, not silent.
  testing::WriteText(
      folder_ + "/odd.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float "
      "y\nproperty float z\nproperty float radius\nend_header\n0 0 0 1\nnan 0 0 1\n1 "
      "0 0 -1\n");
  result = Render("--size 32x32 --json", "odd.ply");
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.err, HasSubstr("2 metaballs cannot be drawn"));
  EXPECT_EQ(json::parse(result.out)["rare_events"]["metaballs_dropped"], 2);

  testing::WriteText(folder_ + "/none.ply",
                     "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float "
                     "y\nproperty float z\nend_header\n");
  result = Render("--size 32x32", "none.ply");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("the picture is empty"));
}

TEST_F(CliRender, MetaballFileGivesThePictureOfItsCloud) {
  CloudInput input;
  input.center = {{10, 0, 0}};
  input.radius = {1};
  input.color = {{188, 100, 50}};
  WriteMetaballFile(folder_ + "/one.metaballs", BuildCloud(input), 0.25);
  ASSERT_EQ(RenderFront("").code, 0);
  fs::rename(folder_ + "/out.png", folder_ + "/by_ply.png");
  // The file's own threshold is the default.
  ASSERT_EQ(
      Render("--size 101x81 --eye 10,-4,0 --look-at 10,0,0 --up 0,0,1 --fov-x 40", "one.metaballs")
          .code,
      0);
  EXPECT_EQ(ComparePictures(folder_ + "/out.png", folder_ + "/by_ply.png").largest, 0);
}

TEST_F(CliRender, SurveyInMapCoordinatesLooksTheSame) {
  const auto ply = [this](const char* name, double x, double y) {
    std::string text =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty "
        "double y\nproperty double z\nproperty float radius\nend_header\n";
    for (const double dx : {0.0, 0.5}) {
      text += std::to_string(x + dx) + " " + std::to_string(y) + " 0 1\n";
    }
    testing::WriteText(folder_ + "/" + name, text);
  };
  ply("origin.ply", 0, 0);
  ply("utm.ply", 500000, 5400000);
  ASSERT_EQ(Render("--size 64x64 --view top", "origin.ply").code, 0);
  fs::rename(folder_ + "/out.png", folder_ + "/origin.png");
  ASSERT_EQ(Render("--size 64x64 --view top", "utm.ply").code, 0);
  EXPECT_EQ(ComparePictures(folder_ + "/out.png", folder_ + "/origin.png").share_off_by_8, 0);
}

TEST_F(CliRender, PhotographCameraTakesPoseAndIntrinsics) {
  testing::WriteWorkspace(folder_ + "/ws", 4900);
  const std::string project = "'" + folder_ + "/p.sherd'";
  ASSERT_EQ(RunSherd("import '" + folder_ + "/ws' --project " + project).code, 0);
  ASSERT_EQ(RunSherd("build " + project + " --levels 4k").code, 0);
  // Its own size where none is given.
  RunResult result =
      Render("--level 4k --photo photo_3.png --color photo --unlit --json", "p.sherd");
  ASSERT_EQ(result.code, 0) << result.err;
  json stats = json::parse(result.out);
  EXPECT_EQ(stats["picture"]["width"], testing::kPhotoWidth);
  EXPECT_NEAR(stats["camera"]["eye"][1].get<double>(), 2.3, 1e-6);
  EXPECT_GT(stats["photographs"]["from_photographs"], 1000);
  // Where the surface is, the picture shows what the photograph showed (the surface waves by a
  // tenth about the plane the photograph was made from).
  const Image rendered = Picture();
  const Image photo = Read(folder_ + "/ws/images/photo_3.png");
  double alike = 0, looked_at = 0;
  for (int y = 40; y < 80; ++y) {
    for (int x = 50; x < 110; ++x) {
      ++looked_at;
      alike += std::abs(rendered.At(x, y, 0) - photo.At(x, y, 0)) < 0.1f;
    }
  }
  EXPECT_GT(alike / looked_at, 0.8);
  // Scaled to the size; a size of another shape is said to stretch.
  result = Render("--photo photo_3.png --size 320x240 --json", "p.sherd");
  EXPECT_NEAR(json::parse(result.out)["camera"]["fx"].get<double>(), 300, 1e-6);
  EXPECT_THAT(result.err, ::testing::Not(HasSubstr("stretched")));
  result = Render("--photo photo_3.png --size 320x120 --json", "p.sherd");
  EXPECT_NEAR(json::parse(result.out)["camera"]["fy"].get<double>(), 150, 1e-6);
  EXPECT_THAT(result.err, HasSubstr("stretched"));
  // Without --level: the largest.
  EXPECT_EQ(stats["level"], "4k");
}

TEST_F(CliRender, WhatWasNotSurveyedIsClosedCountedAndShown) {
  testing::WriteWorkspace(folder_ + "/ws", 4900, false, 0.12);
  const std::string project = "'" + folder_ + "/p.sherd'";
  ASSERT_EQ(RunSherd("import '" + folder_ + "/ws' --project " + project).code, 0);
  ASSERT_EQ(RunSherd("build " + project + " --levels 4k").code, 0);
  const auto closing_points = [&] {
    return json::parse(RunSherd("info --json " + project).out)["levels"][0]["closing_points"]
        .get<int>();
  };
  const std::string from_above =
      "--eye 0,0,4 --look-at 0,0,0 --up 0,1,0 --ortho-width 1.8 --size 90x90 --unlit "
      "--background 1,0,0 --color-by surveyed --color-map grey --color-range 0,1";
  EXPECT_GT(closing_points(), 10);
  ASSERT_EQ(Render(from_above, "p.sherd").code, 0);
  Image image = Picture();
  const auto is_grey = [&](int x, int y) {
    return std::abs(image.At(x, y, 0) - image.At(x, y, 1)) < 0.01f;
  };
  EXPECT_TRUE(is_grey(45, 45));
  EXPECT_LT(image.At(45, 45, 0), 0.15f);
  EXPECT_GT(image.At(15, 45, 0), 0.9f);
  EXPECT_GT(image.At(15, 45, 1), 0.9f);
  EXPECT_THAT(RunSherd("build " + project + " --levels 4k").out, HasSubstr("was up to date"));

  // Kept open where that is asked for: the background shows, and what is there was surveyed.
  const RunResult kept = RunSherd("build " + project + " --levels 4k --keep-holes");
  ASSERT_EQ(kept.code, 0) << kept.err;
  EXPECT_THAT(kept.out, ::testing::Not(HasSubstr("was up to date")));
  EXPECT_EQ(closing_points(), 0);
  ASSERT_EQ(Render(from_above, "p.sherd").code, 0);
  image = Picture();
  EXPECT_FALSE(is_grey(45, 45));
  EXPECT_GT(image.At(15, 45, 1), 0.9f);
}

}  // namespace
}  // namespace sherd
