// The fixed forms of the command line from a workspace to a sheet.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/project/picture.h"
#include "app/project/project.h"
#include "tests/app/run_sherd.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using testing::RunResult;
using testing::RunSherd;

// Imports and builds once for all tests of the suite.
class CliWorkflow : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    // ctest runs every test of the suite in a process of its own, side by side.
    folder_ = ::testing::TempDir() + "sherd_app_cli_workflow_" + std::to_string(getpid());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    testing::WriteWorkspace(folder_ + "/ws", 4900);
    imported_ = RunSherd("import " + Q("ws") + " --project " + Q("p.sherd") +
                         " --metres-per-unit 0.5 --up 0,0,1");
    built_ = RunSherd("build " + Q("p.sherd") + " --levels 1k,2k,4k");
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  // A path in the suite's folder, quoted.
  static std::string Q(const std::string& name) { return "'" + folder_ + "/" + name + "'"; }
  static std::string Path(const std::string& name) { return folder_ + "/" + name; }

  static std::string folder_;
  static RunResult imported_, built_;
};

std::string CliWorkflow::folder_;
RunResult CliWorkflow::imported_, CliWorkflow::built_;

void ExpectSuccess(const RunResult& result) {
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.err, ::testing::Not(HasSubstr("sherd:")));
}

TEST_F(CliWorkflow, ImportTellsWhatItFound) {
  ExpectSuccess(imported_);
  EXPECT_EQ(imported_.err, "");  // no progress where stderr is no terminal
  EXPECT_THAT(imported_.out, HasSubstr("4,900 from a sparse model"));
  EXPECT_THAT(imported_.out, HasSubstr("4, all found"));
  EXPECT_THAT(imported_.out, HasSubstr("1 unit is 500 mm"));
}

TEST_F(CliWorkflow, BuildTellsTheLevels) {
  ExpectSuccess(built_);
  EXPECT_THAT(built_.out, HasSubstr("Built 3 levels"));
  for (const char* level : {"\n  1k ", "\n  2k ", "\n  4k "}) {
    EXPECT_THAT(built_.out, HasSubstr(level));
  }
}

TEST_F(CliWorkflow, InfoOnWorkspaceProjectAndFiles) {
  RunResult result = RunSherd("info " + Q("ws"));
  ExpectSuccess(result);
  EXPECT_THAT(result.out, HasSubstr("sparse/0"));
  EXPECT_THAT(result.out, HasSubstr("4,900"));
  EXPECT_THAT(result.out, HasSubstr("Missing"));

  json found = json::parse(RunSherd("info " + Q("ws") + " --json").out);
  EXPECT_EQ(found["kind"], "workspace");
  ASSERT_EQ(found["models"].size(), 1u);
  EXPECT_EQ(found["models"][0]["images"], 4);
  EXPECT_EQ(found["models"][0]["points"], 4900);
  EXPECT_EQ(found["models"][0]["format"], "text");
  EXPECT_FALSE(found["missing"].empty());

  found = json::parse(RunSherd("info " + Q("p.sherd") + " --json").out);
  EXPECT_EQ(found["kind"], "project");
  EXPECT_EQ(found["points"], 4900);
  EXPECT_EQ(found["metres_per_unit"], 0.5);
  ASSERT_EQ(found["levels"].size(), 3u);
  EXPECT_EQ(found["levels"][0]["name"], "1k");
  EXPECT_NEAR(found["levels"][0]["count"].get<double>(), 1000, 10);
  EXPECT_THAT(RunSherd("info " + Q("p.sherd")).out,
              AllOf(HasSubstr("gaps likely"), HasSubstr("smoothed")));

  const std::string cloud = Q("p.sherd.d/1k/cloud.metaballs");
  found = json::parse(RunSherd("info " + cloud + " --json").out);
  EXPECT_EQ(found["kind"], "metaballs");
  EXPECT_NEAR(found["metaballs"].get<double>(), 1000, 10);
  EXPECT_THAT(RunSherd("info " + cloud).out, HasSubstr("one each"));
}

TEST_F(CliWorkflow, ImportOptionsOfTheFixedForm) {
  fs::rename(Path("ws/images"), Path("photos"));
  RunResult result = RunSherd("import " + Q("ws") + " --project " + Q("no_photos.sherd") +
                              " --sparse --model 0 --json");
  json found = json::parse(result.out);
  EXPECT_EQ(found["photographs"], 4);
  EXPECT_EQ(found["photographs_found"], 0);
  result = RunSherd("import " + Q("ws") + " --project " + Q("no_photos.sherd") + " --photos " +
                    Q("photos") + " --json");
  fs::rename(Path("photos"), Path("ws/images"));
  ExpectSuccess(result);
  found = json::parse(result.out);
  EXPECT_EQ(found["photographs_found"], 4);
  EXPECT_EQ(found["metres_per_unit"], nullptr);

  testing::WritePly(Path("cloud.ply"), 900);
  found = json::parse(
      RunSherd("import " + Q("cloud.ply") + " --project " + Q("ply.sherd") + " --dense --json")
          .out);
  EXPECT_EQ(found["points"], 900);
  EXPECT_EQ(found["dense"], true);
}

TEST_F(CliWorkflow, TheScaleIsMeasuredOrGiven) {
  ExpectSuccess(RunSherd("import " + Q("ws") + " --project " + Q("scaled.sherd") +
                         " --distance 0,0,0 3,4,0 2.5"));
  RunResult result = RunSherd("scale " + Q("scaled.sherd"));
  ExpectSuccess(result);
  EXPECT_THAT(result.out, HasSubstr("One unit is 0.5 m"));
  ExpectSuccess(RunSherd("scale " + Q("scaled.sherd") + " --distance 1,0,0 1,0,-2 0.5"));
  EXPECT_EQ(json::parse(RunSherd("info " + Q("scaled.sherd") + " --json").out)["metres_per_unit"],
            0.25);
  ExpectSuccess(RunSherd("scale " + Q("scaled.sherd") + " --metres-per-unit 3"));
  EXPECT_EQ(json::parse(RunSherd("scale " + Q("scaled.sherd") + " --json").out)["metres_per_unit"],
            3);
  for (const char* wrong :
       {"--distance 1,0,0 1,0,0 1", "--distance 0,0,0 1,0,0 0", "--distance 0,0,0 1,0,0 x",
        "--distance 0,0,0 1,0,0", "--distance 0,0 1,0,0 1", "--markers 4x4_50",
        "--markers none --target-size 1", "--chessboard 9x6 --target-size 0.03",
        "--metres-per-unit 2 --distance 0,0,0 1,0,0 1"}) {
    testing::ExpectFailure(RunSherd("scale " + Q("scaled.sherd") + " " + wrong), 2, "");
  }
  EXPECT_EQ(json::parse(RunSherd("scale " + Q("scaled.sherd") + " --json").out)["metres_per_unit"],
            3)
      << "as it was";
}

TEST_F(CliWorkflow, TheGroundIsLevelled) {
  ExpectSuccess(RunSherd("import " + Q("ws") + " --project " + Q("tilted.sherd")));
  ExpectSuccess(RunSherd("build " + Q("tilted.sherd") + " --levels 500"));
  ExpectSuccess(RunSherd("scale " + Q("tilted.sherd") + " --up -y"));
  EXPECT_EQ(json::parse(RunSherd("info " + Q("tilted.sherd") + " --json").out)["up"],
            json({0, -1, 0}));
  // With y up the square is a wall.
  testing::ExpectFailure(RunSherd("scale " + Q("tilted.sherd") + " --level-ground"), 2,
                         "no ground to level");
  const RunResult result = RunSherd("scale " + Q("tilted.sherd") +
                                    " --up 0,0.1,1 --level-ground --ground-tolerance 0.2 --json");
  ExpectSuccess(result);
  const json found = json::parse(result.out);
  EXPECT_EQ(found["up"], json({0, 0, 1}));
  EXPECT_NEAR(found["ground"]["tilt_deg"].get<double>(), 5.7, 1);
  EXPECT_GT(found["ground"]["share"].get<double>(), 0.9);
  EXPECT_EQ(found["ground"]["transform"].size(), 8u);
  ExpectSuccess(RunSherd("render " + Q("tilted.sherd") + " --size 40x30 --out " + Q("level.png") +
                         " --backend cpu"));
  testing::ExpectFailure(RunSherd("scale " + Q("tilted.sherd") + " --ground-tolerance 1"), 2,
                         "--level-ground");
}

TEST_F(CliWorkflow, ATransformMovesTheProject) {
  testing::WriteText(Path("transform.txt"), "2 1 0 0 0 500000 4500000 100\n");
  ExpectSuccess(RunSherd("import " + Q("ws") + " --project " + Q("moved.sherd") + " --transform " +
                         Q("transform.txt") + " --metres-per-unit 1"));
  const Box3d before = Project::Open(Path("p.sherd")).bounds();
  const Box3d after = Project::Open(Path("moved.sherd")).bounds();
  EXPECT_NEAR(after.min.x, 2 * before.min.x + 500000, 1e-6);
  EXPECT_NEAR(after.max.y, 2 * before.max.y + 4500000, 1e-6);
  const std::string info = "info " + Q("moved.sherd");
  EXPECT_EQ(json::parse(RunSherd(info + " --json").out)["project_from_source"],
            json({2, 1, 0, 0, 0, 500000, 4500000, 100}));
  EXPECT_THAT(RunSherd(info).out, HasSubstr("scaled by 2, turned by 0 degrees and moved by 500"));
  EXPECT_THAT(RunSherd("info " + Q("p.sherd")).out, Not(HasSubstr("turned by")));
  testing::ExpectFailure(RunSherd("import " + Q("ws") + " --project " + Q("moved.sherd") +
                                  " --transform " + Q("ws/sparse/0/cameras.txt")),
                         2, "cameras.txt");
}

TEST_F(CliWorkflow, AMeshBecomesLevels) {
  fs::create_directories(Path("mesh"));
  testing::WriteText(Path("mesh/roof.obj"),
                     "mtllib roof.mtl\nv 0 0 0\nv 4 0 0\nv 4 3 1\nv 0 3 1\nvt 0 0\nvt 1 0\nvt 1 1\n"
                     "vt 0 1\nusemtl tile\nf 1/1 2/2 3/3 4/4\n");
  testing::WriteText(Path("mesh/roof.mtl"), "newmtl tile\nKd 1 0 0\nmap_Kd tile.png\n");
  const std::string import = "import " + Q("mesh/roof.obj") + " --project " + Q("roof.sherd");
  const RunResult result = RunSherd(import + " --samples 5k");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("5,000 from a mesh"));
  EXPECT_THAT(result.out, HasSubstr("tile.png is missing"));
  EXPECT_THAT(RunSherd("info " + Q("mesh")).out, HasSubstr("roof.obj"));
  ExpectSuccess(RunSherd("build " + Q("roof.sherd") + " --levels 1k"));
  const auto level = Project::Open(Path("roof.sherd")).LoadLevel("1k");
  EXPECT_NEAR(static_cast<double>(level->cloud.size()), 1000, 10);
  ASSERT_FALSE(level->cloud.color.empty());
  EXPECT_EQ(level->cloud.color[0], (Rgb8{255, 0, 0}));

  EXPECT_THAT(RunSherd(import + " --vertices").out, HasSubstr("4 from a mesh"));
  testing::ExpectFailure(
      RunSherd("import " + Q("ws") + " --project " + Q("x.sherd") + " --samples 5"), 2,
      "has no triangles");
  testing::WriteText(Path("mesh/part.glb"), "glTF");
  testing::ExpectFailure(RunSherd("import " + Q("mesh/part.glb") + " --project " + Q("x.sherd")), 2,
                         "part.glb");
  EXPECT_FALSE(fs::exists(Path("x.sherd")));
}

TEST_F(CliWorkflow, LevelsThatAreUpToDateAreKept) {
  const std::string json_before = testing::ReadText(Path("p.sherd"));
  RunResult result = RunSherd("build " + Q("p.sherd") + " --levels 2k --json");
  ExpectSuccess(result);
  json built = json::parse(result.out);
  EXPECT_TRUE(built["built"].empty());
  EXPECT_EQ(built["up_to_date"], json::array({"2k"}));
  EXPECT_EQ(testing::ReadText(Path("p.sherd")), json_before);
  result = RunSherd("build " + Q("p.sherd") + " --levels 2k --fresh --json");
  built = json::parse(result.out);
  ASSERT_EQ(built["built"].size(), 1u);
  EXPECT_NEAR(built["built"][0]["count"].get<double>(), 2000, 20);
  // Other options: another level.
  result = RunSherd("build " + Q("p.sherd") + " --levels 2k --radius-factor 3 --json");
  built = json::parse(result.out);
  ASSERT_EQ(built["built"].size(), 1u);
  ExpectSuccess(RunSherd("build " + Q("p.sherd") + " --levels 2k"));
  // More than there are.
  result = RunSherd("build " + Q("p.sherd") + " --levels 9k");
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.err, HasSubstr("warning: level 9k holds every point"));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
}

TEST_F(CliWorkflow, CompareMakesSheetTableAndPanels) {
  const RunResult result = RunSherd(
      "compare " + Q("p.sherd") + " --levels 1k,4k --view top --ortho --size 1400x800" + " --out " +
      Q("sheet.png") + " --csv " + Q("sheet.csv") + " --separate " + Q("panels") + " --json");
  ExpectSuccess(result);
  const json found = json::parse(result.out);
  EXPECT_EQ(found["width"], 1400);
  ASSERT_EQ(found["levels"].size(), 2u);
  EXPECT_EQ(found["levels"][1]["name"], "4k");
  EXPECT_EQ(found["camera"]["projection"], "orthographic");
  EXPECT_GT(found["levels"][0]["render"]["hits"], 1000);
  EXPECT_THAT(testing::Listing(Path("panels")), ::testing::ElementsAre("1k.png", "4k.png"));
  const std::string csv = testing::ReadText(Path("sheet.csv"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3);
  EXPECT_THAT(csv, HasSubstr("\n4k,"));
  EXPECT_THAT(csv, HasSubstr("spacing_m"));
  // The sheet is a picture of the size asked for, and not an empty one: it differs from its panels'
  // sizes and from another view's sheet.
  ExpectSuccess(RunSherd("compare " + Q("p.sherd") +
                         " --levels 1k,4k --view front --size 1400x800" + " --out " +
                         Q("sheet2.png")));
  const PictureDifference d = ComparePictures(Path("sheet.png"), Path("sheet2.png"));
  EXPECT_GT(d.share_off_by_8, 0.02);
}

TEST_F(CliWorkflow, CompareWithoutLevelsTakesAll) {
  const RunResult result = RunSherd("compare " + Q("p.sherd") + " --photo photo_2.png --out " +
                                    Q("all.png") + " --json");
  ExpectSuccess(result);
  const json found = json::parse(result.out);
  EXPECT_GE(found["levels"].size(), 3u);
  // The photograph's shape is kept.
  EXPECT_NEAR(found["camera"]["fx"].get<double>(), found["camera"]["fy"].get<double>(), 1e-6);
}

TEST_F(CliWorkflow, ComparesWithTheColoursOfThePhotographs) {
  const RunResult result =
      RunSherd("compare " + Q("p.sherd") +
               " --levels 1k --color photo --unlit --size 1280x720 --out " + Q("photo.png"));
  ExpectSuccess(result);
  ExpectSuccess(RunSherd("compare " + Q("p.sherd") + " --levels 1k --unlit --size 1280x720 --out " +
                         Q("blend.png")));
  EXPECT_GT(ComparePictures(Path("photo.png"), Path("blend.png")).share_off_by_8, 0.01);
}

TEST_F(CliWorkflow, DevicesNamesBothBackends) {
  const RunResult result = RunSherd("devices");
  ExpectSuccess(result);
  EXPECT_THAT(result.out, HasSubstr("cpu"));
  EXPECT_THAT(result.out, HasSubstr("cuda"));
  const json found = json::parse(RunSherd("devices --json").out);
  ASSERT_EQ(found["backends"].size(), 2u);
  const bool cuda = found["backends"][1]["available"];
  EXPECT_EQ(found["auto"], cuda ? "cuda" : "cpu");
  EXPECT_EQ(found["backends"][1]["reason"].is_null(), cuda);
  EXPECT_EQ(found["auto_gpu"].is_null(), !cuda);
  for (const std::string part : {"driver", "toolkit"}) {
    const json& version = found["cuda_" + part];
    EXPECT_THAT(result.out,
                HasSubstr(part + " " + (version.is_null() ? "none" : version.get<std::string>())));
  }
  for (const json& gpu : found["gpus"]) {
    EXPECT_THAT(result.out, HasSubstr("GPU " + std::to_string(gpu["index"].get<int>())));
    EXPECT_EQ(gpu["reason"].is_null(), gpu["available"]);
  }
}

TEST_F(CliWorkflow, LinksNoQt) {
  const std::string list = Path("ldd");
  ASSERT_EQ(std::system(("ldd '" SHERD_PROGRAM "' >'" + list + "'").c_str()), 0);
  const std::string libraries = testing::ReadText(list);
  EXPECT_THAT(libraries, HasSubstr("libOpenImageIO"));
  EXPECT_THAT(libraries, ::testing::Not(HasSubstr("libQt")));
}

TEST_F(CliWorkflow, HelpHasExamplesForEveryCommand) {
  for (const char* command :
       {"info", "reconstruct", "import", "scale", "build", "render", "compare", "devices"}) {
    const RunResult result = RunSherd(std::string(command) + " --help");
    ExpectSuccess(result);
    EXPECT_THAT(result.out, HasSubstr("Example")) << command;
    EXPECT_THAT(result.out, HasSubstr(std::string("sherd ") + command)) << command;
  }
  EXPECT_THAT(RunSherd("--help").out, HasSubstr("Exit codes"));
  EXPECT_THAT(RunSherd("--version").out, HasSubstr("sherd "));
}

}  // namespace
}  // namespace sherd
