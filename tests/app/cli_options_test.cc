#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "app/cli/device_list.h"
#include "app/cli/look_options.h"
#include "app/cli/option_types.h"
#include "app/cli/progress.h"
#include "app/cli/table.h"
#include "metaball/error.h"

namespace sherd::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(OptionTypes, Vectors) {
  EXPECT_EQ(ParseVector("1,2,3"), (Vec3d{1, 2, 3}));
  EXPECT_EQ(ParseVector("-.5,+1e3,0"), (Vec3d{-0.5, 1000, 0}));
  for (const char* bad : {"", "1,2", "1,2,3,4", "1,2,x", "1, 2,3", "nan,0,0", "inf,0,0", "1,,2"}) {
    EXPECT_THROW(ParseVector(bad), InputError) << bad;
  }
}

TEST(OptionTypes, Directions) {
  EXPECT_EQ(ParseDirection("z"), (Vec3d{0, 0, 1}));
  EXPECT_EQ(ParseDirection("-y"), (Vec3d{0, -1, 0}));
  EXPECT_EQ(ParseDirection("+x"), (Vec3d{1, 0, 0}));
  EXPECT_EQ(ParseDirection("-1,0,2"), (Vec3d{-1, 0, 2}));
  for (const char* bad : {"", "-", "w", "--x", "xy", "X"}) {
    EXPECT_THROW(ParseDirection(bad), InputError) << bad;
  }
}

TEST(OptionTypes, Sizes) {
  EXPECT_EQ(ParseSize("1280x720").width, 1280);
  EXPECT_EQ(ParseSize("1x99999").height, 99999);
  for (const char* bad :
       {"", "1280", "1280x", "x720", "0x5", "-4x5", "4x5x6", "4.5x6", "99999999999x5", "4 x 5"}) {
    EXPECT_THROW(ParseSize(bad), InputError) << bad;
  }
}

TEST(OptionTypes, Counts) {
  EXPECT_THAT(ParseCounts("63k,126k"), ElementsAre(63000, 126000));
  EXPECT_THAT(ParseCounts("500,0.5k,1M"), ElementsAre(500, 1000000));
  for (const char* bad : {"", "63k,", "0", "-5", "many"}) {
    EXPECT_THROW(ParseCounts(bad), InputError) << bad;
  }
}

// What the options make of a command line.
LookOptions Parse(const std::string& line) {
  CLI::App app;
  LookOptions look;
  AddLookOptions(&app, &look);
  app.parse(line);
  return look;
}

TEST(LookOptions, TheSurfaceIsTheSourcesButForWhatIsSaid) {
  Surface own;
  own.threshold = 0.2;
  own.density = ParseDensity("wyvill");
  own.mode = ThresholdMode::kBlended;
  const Surface kept = Parse("").SurfaceOf(own);
  EXPECT_EQ(kept.threshold, 0.2);
  EXPECT_EQ(kept.density.kind, DensityKind::kWyvill);
  EXPECT_EQ(kept.mode, ThresholdMode::kBlended);
  EXPECT_EQ(Parse("--threshold 0.5").SurfaceOf(own).mode, ThresholdMode::kUniform);
  const Surface asked =
      Parse("--density blinn:8,2 --thresholds gated --threshold 0.5").SurfaceOf(own);
  EXPECT_EQ(asked.density.kind, DensityKind::kBlinn);
  EXPECT_EQ(asked.density.rate, 8);
  EXPECT_EQ(asked.mode, ThresholdMode::kGated);
  EXPECT_EQ(asked.threshold, 0.5);
  for (const char* bad :
       {"--density blob", "--density power:99", "--thresholds none", "--method magic",
        "--method thesis --backend cuda", "--method thesis --device 0"}) {
    EXPECT_THROW(Parse(bad), CLI::ParseError) << bad;
  }
}

TEST(LookOptions, AMethodOfComparisonCanBeChosen) {
  std::string why;
  const auto thesis = RendererOf(Parse("--method thesis"), &why);
  EXPECT_NE(thesis->device().find("thesis"), std::string::npos) << thesis->device();
  EXPECT_EQ(RendererOf(Parse("--backend cpu"), &why)->backend(), "cpu");
}

TEST(LookOptions, TheDeviceIsOneValue) {
  EXPECT_EQ(Parse("").Device(), DeviceChoice{});
  EXPECT_EQ(Parse("--backend cpu").Device(), (DeviceChoice{Backend::kCpu}));
  EXPECT_EQ(Parse("--backend cuda").Device(), (DeviceChoice{Backend::kCuda}));
  // A GPU by its number is that GPU or an error, whether or not --backend says cuda too.
  EXPECT_EQ(Parse("--device 2").Device(), (DeviceChoice{Backend::kCuda, 2}));
  EXPECT_EQ(Parse("--device 2 --backend cuda").Device(), (DeviceChoice{Backend::kCuda, 2}));
  EXPECT_EQ(Parse("--device all --backend auto").Device(),
            (DeviceChoice{Backend::kCuda, DeviceChoice::kAll}));
  EXPECT_THROW(Parse("--device 0 --backend cpu").Device(), InputError);
  for (const char* bad : {"--device -1", "--device x", "--device 1,2", "--device \"\""}) {
    EXPECT_THROW(Parse(bad), CLI::ParseError) << bad;
  }
}

TEST(DeviceRows, NameEveryGpuAndWhatIsWrongWithIt) {
  GpuList gpus;
  gpus.driver_version = 12080;
  gpus.toolkit_version = 13000;
  gpus.reason = "no NVIDIA GPU in this machine";
  EXPECT_EQ(
      DeviceRows(gpus),
      (std::vector<std::vector<std::string>>{
          {"cuda", "not available: no NVIDIA GPU in this machine (driver 12.8, toolkit 13.0)"}}));
  EXPECT_EQ(ToJson(gpus.devices), Json::array());
  gpus.reason.clear();
  gpus.devices = {{0, "Fake A", 9, 0, 8ull << 30, ""},
                  {1, "Fake B", 6, 1, 4ull << 30, "its architecture 6.1 is older than 7.5"},
                  {2, "", 0, 0, 0, "it does not answer: unknown error"}};
  EXPECT_EQ(
      DeviceRows(gpus),
      (std::vector<std::vector<std::string>>{
          {"cuda", "driver 12.8, toolkit 13.0"},
          {"GPU 0", "Fake A, 9.0, 8 GB"},
          {"GPU 1", "Fake B, 6.1, 4 GB: not available: its architecture 6.1 is older than 7.5"},
          {"GPU 2", "not available: it does not answer: unknown error"}}));
  const Json json = ToJson(gpus.devices);
  ASSERT_EQ(json.size(), 3u);
  EXPECT_EQ(json[0]["memory_bytes"], 8ull << 30);
  EXPECT_TRUE(json[0]["available"] && json[0]["reason"].is_null());
  EXPECT_EQ(json[1]["architecture"], "6.1");
  EXPECT_FALSE(json[1]["available"]);
  EXPECT_TRUE(json[2]["name"].is_null());
  EXPECT_EQ(json[2]["reason"], "it does not answer: unknown error");
}

TEST(LookOptions, LightAlongAVectorSwitchesTheHeadlightOff) {
  EXPECT_TRUE(Parse("").Light().headlight);
  const Lighting light = Parse("--light -0.5,1,-0.6 --ambient 0.2 --diffuse 0.8").Light();
  EXPECT_FALSE(light.headlight);
  EXPECT_EQ(light.to_light, (Vec3d{-0.5, 1, -0.6}));
  EXPECT_EQ(light.ambient, 0.2);
  EXPECT_EQ(light.diffuse, 0.8);
  EXPECT_FALSE(light.unlit);
  EXPECT_TRUE(Parse("--unlit").Light().unlit);
}

TEST(LookOptions, ContradictionsAreRefused) {
  for (const char* bad : {"--photo a --view top",
                          "--photo a --eye 1,2,3",
                          "--photo a --fov-x 50",
                          "--view top --eye 1,2,3",
                          "--look-at 1,2,3",
                          "--fov-x 50 --ortho-width 2",
                          "--fov-x 50 --ortho",
                          "--view above",
                          "--fov-x 0",
                          "--fov-x 171",
                          "--threshold 0",
                          "--threshold x",
                          "--supersample 1.5",
                          "--supersample 9",
                          "--light 0,0,0",
                          "--bits 12",
                          "--background red",
                          "--background 255,0,0",
                          "--color white",
                          "--backend gpu",
                          "--radius-scale -1",
                          "--size 5"}) {
    EXPECT_THROW(Parse(bad), CLI::ParseError) << bad;
  }
}

TEST(LookOptions, SurfaceTakesTheLevelsThreshold) {
  EXPECT_EQ(Parse("").SurfaceOf(0.4).threshold, 0.4);
  EXPECT_EQ(Parse("--threshold 0.9").SurfaceOf(0.4).threshold, 0.9);
  EXPECT_EQ(Parse("--radius-scale 2").SurfaceOf(0.4).radius_scale, 2);
}

TEST(Progress, LineSaysHowFarAndHowLong) {
  EXPECT_EQ(ProgressLine("reading", 0.5, 10, 80), "reading  50 %  about 10 s left");
  EXPECT_EQ(ProgressLine("reading", 0.5, 1, 80), "reading  50 %");
  EXPECT_EQ(ProgressLine("reading", 0.01, 10, 80), "reading  1 %");
  EXPECT_EQ(ProgressLine("reading", 1, 10, 80), "reading  100 %");
  EXPECT_EQ(ProgressLine("reading", 7, 10, 80), "reading  100 %");
  EXPECT_LT(ProgressLine(std::string(200, 'x'), 0.5, 10, 60).size(), 60u);
  EXPECT_THAT(ProgressLine(std::string(200, 'x'), 0.5, 10, 60), HasSubstr("10 s left"));
}

TEST(Table, AlignsColumnsByCharacters) {
  EXPECT_EQ(Table({{"a", "bb"}, {"\u00e4\u00e4\u00e4", "c"}}, 0),
            "a    bb\n\u00e4\u00e4\u00e4   c\n");
  EXPECT_EQ(Table({{"a", "bb"}, {"aa", "c"}}, 1, {1}), " a   bb\n aa  c\n");
  EXPECT_EQ(Fields({{"x", "1"}, {"long", ""}, {"yy", "2"}}, 0), "x   1\nyy  2\n");
}

}  // namespace
}  // namespace sherd::cli
