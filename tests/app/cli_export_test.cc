// sherd export: every output from every source.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "metaball/error.h"
#include "metaball/metaball_file.h"
#include "metaball/thesis_file.h"
#include "reconstruction/ply.h"
#include "tests/app/run_sherd.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::ElementsAre;
using testing::ExpectFailure;
using ::testing::HasSubstr;
using testing::RunResult;
using testing::RunSherd;

class CliExport : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::FreshFolder("export");
    // One metaball of radius 1 at (10, 0, 0); at threshold 0.25 its surface is the sphere of radius
    // sqrt(1/2).
    testing::WriteText(folder_ + "/one.ply",
                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                       "y\nproperty float z\nproperty float radius\nproperty uchar red\nproperty "
                       "uchar green\nproperty uchar blue\nend_header\n10 0 0 1 188 100 50\n");
    testing::WriteText(folder_ + "/square.obj",
                       "mtllib square.mtl\nusemtl earth\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"
                       "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n");
    testing::WriteText(folder_ + "/square.mtl", "newmtl earth\nmap_Kd earth.png\n");
  }
  std::string Q(const std::string& name) const { return "'" + folder_ + "/" + name + "'"; }
  RunResult Export(const std::string& source, const std::string& out,
                   const std::string& options = "") const {
    return RunSherd("export " + Q(source) + " " + Q(out) + " " + options);
  }
  std::string Text(const std::string& name) const {
    return testing::ReadText(folder_ + "/" + name);
  }

  std::string folder_;
};

TEST_F(CliExport, AMeshAsPlyIsTheSphere) {
  const RunResult result = Export("one.ply", "out.ply", "--threshold 0.25 --cell 0.1 --json");
  ASSERT_EQ(result.code, 0) << result.err;
  const PlyCloud ply = ReadPly(folder_ + "/out.ply");
  EXPECT_FALSE(ply.float_positions);
  const json report = json::parse(result.out);
  EXPECT_EQ(report["vertices"], ply.position.size());
  EXPECT_EQ(report["triangles"], ply.faces);
  EXPECT_EQ(report["cell_size"], 0.1);
  ASSERT_GT(ply.position.size(), 100u);
  for (std::size_t i = 0; i < ply.position.size(); ++i) {
    const Vec3d d = ply.position[i] - Vec3d{10, 0, 0};
    ASSERT_NEAR(Length(d), std::sqrt(0.5), 1e-6);
    ASSERT_NEAR(Dot(Normalized(d), ply.normal[i].cast<double>()), 1, 1e-6);
    ASSERT_EQ(ply.color[i], (Rgb8{188, 100, 50}));
  }
  // Half as large a cell: four times the vertices.
  const RunResult finer =
      Export("one.ply", "fine.ply", "--threshold 0.25 --cell-radii 0.05 --json");
  EXPECT_NEAR(json::parse(finer.out)["vertices"].get<double>() / ply.position.size(), 4, 0.4);
}

TEST_F(CliExport, AMeshAsObjKeepsTheTexture) {
  ASSERT_EQ(Export("square.obj", "out.obj", "--samples 400 --cell-radii 0.6").code, 0);
  EXPECT_THAT(Text("out.obj"), HasSubstr("\nvt "));
  EXPECT_THAT(Text("out.mtl"), HasSubstr("map_Kd earth.png"));
  ASSERT_EQ(Export("square.obj", "named.obj", "--samples 400 --texture other.png").code, 0);
  EXPECT_THAT(Text("named.mtl"), HasSubstr("map_Kd other.png"));
}

TEST_F(CliExport, APovRaySceneLooksThroughTheCamera) {
  const RunResult result = Export("one.ply", "out.pov",
                                  "--threshold 0.25 --eye 10,-4,0 --look-at 10,0,0 --up 0,0,1 "
                                  "--fov-x 40 --size 160x90 --light 0,-1,0");
  ASSERT_EQ(result.code, 0) << result.err;
  const std::string scene = Text("out.pov");
  EXPECT_THAT(scene, HasSubstr("blob { threshold 0.25\n"));
  EXPECT_THAT(scene, HasSubstr("location <10,-4,0>"));
  if (std::system("command -v povray >/dev/null 2>&1") != 0) GTEST_SKIP() << "no povray";
  const std::string command =
      "cd '" + folder_ + "' && povray +Iout.pov +Oout.png +W160 +H90 -D " + "+WT2 >/dev/null 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST_F(CliExport, MetaballFilesGoRoundThroughEveryFormat) {
  testing::WritePly(folder_ + "/cloud.ply", 300);
  ASSERT_EQ(Export("cloud.ply", "a.metaballs", "--threshold 0.5").code, 0);
  ASSERT_EQ(Export("a.metaballs", "b.mbt").code, 0);
  ASSERT_EQ(RunSherd("convert " + Q("b.mbt") + " " + Q("c.mbb")).code, 0);
  ASSERT_EQ(Export("c.mbb", "d.metaballs").code, 0);
  const MetaballFile a = ReadMetaballFile(folder_ + "/a.metaballs");
  const MetaballFile d = ReadMetaballFile(folder_ + "/d.metaballs");
  EXPECT_EQ(d.threshold, 0.5);
  EXPECT_EQ(d.cloud.color, a.cloud.color);
  ASSERT_EQ(d.cloud.size(), a.cloud.size());
  ASSERT_GT(d.cloud.size(), 250u);
  for (std::size_t i = 0; i < a.cloud.size(); ++i) {
    EXPECT_LT(Length(d.cloud.frame.WorldFromLocal(d.cloud.center[i]) -
                     a.cloud.frame.WorldFromLocal(a.cloud.center[i])),
              2e-6);
  }
  // And they can be drawn and looked into.
  EXPECT_EQ(RunSherd("render " + Q("b.mbt") + " --size 40x30 --out " + Q("b.png")).code, 0);
  const json info = json::parse(RunSherd("info " + Q("c.mbb") + " --json").out);
  EXPECT_EQ(info["metaballs"], a.cloud.size());
  EXPECT_EQ(info["threshold"], 0.5);
  EXPECT_EQ(info["density"], "murakami");
}

TEST_F(CliExport, ThresholdsOfTheMetaballsAreKeptUntilOneIsAskedFor) {
  testing::WriteText(folder_ + "/t.mbt", "2\n5\n0\n1\n0 0 0 0.25\n5 0 0 0.5\n");
  ASSERT_EQ(Export("t.mbt", "own.metaballs").code, 0);
  const MetaballFile own = ReadMetaballFile(folder_ + "/own.metaballs");
  EXPECT_EQ(own.mode, ThresholdMode::kBlended);
  EXPECT_THAT(own.cloud.threshold, ElementsAre(0.25f, 0.5f));
  ExpectFailure(Export("t.mbt", "own.pov"), 2, "thresholds");
  EXPECT_FALSE(fs::exists(folder_ + "/own.pov"));
  ASSERT_EQ(Export("t.mbt", "one.pov", "--threshold 0.4").code, 0);
  EXPECT_THAT(Text("one.pov"), HasSubstr("blob { threshold 0.4\n"));
}

TEST_F(CliExport, MeshesBecomeMetaballs) {
  ASSERT_EQ(Export("square.obj", "corners.mbt").code, 0);
  const ThesisFile corners = ReadThesisFile(folder_ + "/corners.mbt");
  EXPECT_EQ(corners.count, 4u);
  EXPECT_EQ(corners.flags, static_cast<std::uint32_t>(kThesisCenter | kThesisRadius |
                                                      kThesisNormal | kThesisColor));
  EXPECT_THAT(corners.names, ::testing::Contains("earth.png"));
  ASSERT_EQ(Export("square.obj", "many.metaballs", "--samples 1k --radius-factor 2").code, 0);
  const Cloud many = ReadMetaballFile(folder_ + "/many.metaballs").cloud;
  EXPECT_EQ(many.size(), 1000u);
  EXPECT_NE(many.FindChannel("uv"), nullptr);
  EXPECT_NE(many.FindChannel("normal"), nullptr);
}

TEST_F(CliExport, AProjectsLevelKeepsItsNormals) {
  testing::WriteWorkspace(folder_ + "/ws", 900);
  ASSERT_EQ(RunSherd("import " + Q("ws") + " --project " + Q("p.sherd")).code, 0);
  ASSERT_EQ(RunSherd("build " + Q("p.sherd") + " --levels 300,500").code, 0);
  ASSERT_EQ(Export("p.sherd", "level.mbb", "--level 300").code, 0);
  const ThesisFile file = ReadThesisFile(folder_ + "/level.mbb");
  EXPECT_NEAR(file.count, 300, 3);
  EXPECT_TRUE(file.flags & kThesisNormal);
  EXPECT_TRUE(file.flags & kThesisColor);
  ASSERT_EQ(Export("p.sherd", "view.pov", "--photo photo_1.png").code, 0);
  EXPECT_THAT(Text("view.pov"), HasSubstr("+W160 +H120"));  // the photograph's own size
  ASSERT_EQ(Export("p.sherd", "mesh.ply").code, 0);
  EXPECT_GT(ReadPly(folder_ + "/mesh.ply").faces, 500u);
}

TEST_F(CliExport, BadInputIsOneLine) {
  const auto before = testing::Listing(folder_);
  ExpectFailure(RunSherd("export " + Q("one.ply")), 2, "OUT");
  ExpectFailure(Export("one.ply", "out.xyz"), 3, "its extension must be");
  ExpectFailure(Export("none.ply", "out.ply"), 2, "does not exist");
  ExpectFailure(Export("one.ply", "none/out.ply"), 3, "none/out.ply");
  ExpectFailure(Export("one.ply", "out.ply", "--cell 0"), 2, "--cell");
  ExpectFailure(Export("one.ply", "out.ply", "--cell 1 --cell-radii 1"), 2, "excludes");
  ExpectFailure(Export("one.ply", "out.ply", "--cell 1e-9"), 2, "larger cell");
  ExpectFailure(Export("one.ply", "out.ply", "--view top"), 2, "--view has a meaning for a .pov");
  ExpectFailure(Export("one.ply", "out.pov", "--cell 1"), 2, "--cell has a meaning for meshes");
  ExpectFailure(Export("one.ply", "out.ply", "--level 63k"), 2, "has no levels");
  ExpectFailure(Export("one.ply", "out.ply", "--samples 0"), 2, "--samples");
  ExpectFailure(Export("one.ply", "out.ply", "--samples 100"), 2, "one.ply");
  testing::WriteText(folder_ + "/bad.mbt", "1\n1\n0\n1\n1\n0 0 nan\n");
  ExpectFailure(Export("bad.mbt", "out.ply"), 2, "line 6");
  ExpectFailure(Export("bad.mbt", "out.ply", "--samples 5"), 2, "no triangles");
  testing::WriteText(folder_ + "/bad.mbb", "xx");
  ExpectFailure(Export("bad.mbb", "out.ply"), 2, "byte 0");
  testing::WriteText(folder_ + "/bad.obj", "hello\n");
  ExpectFailure(Export("bad.obj", "out.ply"), 2, "bad.obj");
  for (const char* name : {"bad.mbt", "bad.mbb", "bad.obj"}) fs::remove(folder_ + "/" + name);
  EXPECT_EQ(testing::Listing(folder_), before);
}

TEST_F(CliExport, AFullDiskLeavesNothing) {
  testing::WritePly(folder_ + "/cloud.ply", 2000);
  const auto before = testing::Listing(folder_);
  for (const char* name : {"a.ply", "a.obj", "a.pov", "a.metaballs", "a.mbt", "a.mbb"}) {
    ExpectFailure(RunSherd("export " + Q("cloud.ply") + " " + Q(name), "ulimit -f 8;"), 3, name);
  }
  EXPECT_EQ(testing::Listing(folder_), before);
}

TEST_F(CliExport, AnEmptyMeshIsWrittenAndSaid) {
  const RunResult result = Export("one.ply", "out.ply", "--threshold 2");
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.err, HasSubstr("the mesh is empty"));
  EXPECT_EQ(ReadPly(folder_ + "/out.ply").position.size(), 0u);
}

}  // namespace
}  // namespace sherd
