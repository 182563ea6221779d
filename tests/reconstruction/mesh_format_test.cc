// The same textured mesh in every format.
#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <cmath>

#include "metaball/error.h"
#include "reconstruction/mesh_import.h"
#include "reconstruction/mesh_points.h"
#include "reconstruction/workspace.h"
#include "tests/reconstruction/mesh_files.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using namespace test;  // NOLINT

// Upright squares side by side, from x = 0, 10 and 20, each 2 wide and 3 high: the first two have a
// texture each, the third a plain colour.
void WriteThreeSquares(const std::string& folder) {
  std::string obj = "mtllib three.mtl\n";
  for (const int x : {0, 10, 20}) {
    const std::string left = std::to_string(x), right = std::to_string(x + 2);
    obj += "v " + left + " 5 0\nv " + right + " 5 0\nv " + right + " 5 3\nv " + left + " 5 3\n";
  }
  obj += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl one\nf 1/1 2/2 3/3 4/4\n";
  obj += "usemtl two\nf 5/1 6/2 7/3 8/4\nusemtl plain\nf 9/1 10/2 11/3 12/4\n";
  WriteFile(folder + "/three.obj", obj);
  WriteFile(folder + "/three.mtl",
            "newmtl one\nKd 1 1 1\nmap_Kd one.png\nnewmtl two\nKd 1 1 1\nmap_Kd two.jpg\n"
            "newmtl plain\nKd 0.8 0.2 0\n");
  WritePicture(folder + "/one.png", 16, 16, Quarters);
  WritePicture(folder + "/two.jpg", 16, 16, [](int, int) { return kBlue; });
}

struct Format {
  const char* name;
  const char* assimp_id;  // of its exporter; null: the .obj itself
  bool linear = false;    // material colours are linear numbers
  bool has_length = false;
};
void PrintTo(const Format& format, std::ostream* out) { *out << format.name; }

class MeshFormat : public ::testing::TestWithParam<Format> {
 protected:
  void SetUp() override {
    folder_ = TestFolder();
    WriteThreeSquares(folder_);
    path_ = folder_ + "/three." + GetParam().name;
    if (!GetParam().assimp_id) return;
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(folder_ + "/three.obj", 0);
    ASSERT_TRUE(scene) << importer.GetErrorString();
    Assimp::Exporter exporter;
    ASSERT_EQ(exporter.Export(scene, GetParam().assimp_id, path_), aiReturn_SUCCESS)
        << exporter.GetErrorString();
  }

  std::string folder_, path_;
};

int Difference(Rgb8 a, Rgb8 b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

TEST_P(MeshFormat, ColorsAreWhereTheMeshPutsThem) {
  const ImportedMesh mesh = ReadMesh(path_);
  EXPECT_EQ(mesh.TextureName(), "");  // there are two
  const MeshPoints points = PointsOnTriangles(mesh, 6000);
  EXPECT_THAT(points.warnings, IsEmpty());
  ASSERT_EQ(points.position.size(), 6000u);
  ASSERT_EQ(points.color.size(), 6000u);
  const Rgb8 plain = GetParam().linear ? Rgb8FromLinear({0.8f, 0.2f, 0}) : Rgb8{204, 51, 0};
  int checked[3] = {};
  for (std::size_t i = 0; i < 6000; ++i) {
    const Vec3d& p = points.position[i];
    EXPECT_NEAR(p.y, 5, 1e-6);
    EXPECT_NEAR(std::abs(points.normal[i].y), 1, 1e-5);
    const int square = static_cast<int>(p.x / 10);
    const double u = (p.x - 10 * square) / 2, v = p.z / 3;
    ASSERT_TRUE(u > -1e-6 && u < 1 + 1e-6 && v > -1e-6 && v < 1 + 1e-6) << p.x << " " << p.z;
    if (square == 0) {
      // Away from where the quarters meet, the border of the repeating image included.
      const double side_u = std::abs(u - 0.5), side_v = std::abs(v - 0.5);
      if (side_u < 0.05 || side_v < 0.05 || side_u > 0.45 || side_v > 0.45) continue;
      const Rgb8 expected = Quarters(static_cast<int>(u * 16), static_cast<int>((1 - v) * 16));
      EXPECT_LE(Difference(points.color[i], expected), 1) << u << " " << v;
    } else if (square == 1) {
      EXPECT_LE(Difference(points.color[i], kBlue), 4);  // a JPEG
    } else {
      EXPECT_LE(Difference(points.color[i], plain), 1);
    }
    ++checked[square];
  }
  EXPECT_GT(checked[0], 1000);
  EXPECT_EQ(checked[1], 2000);
  EXPECT_EQ(checked[2], 2000);
}

TEST_P(MeshFormat, VerticesHaveTheirColors) {
  const MeshPoints points = PointsAtVertices(ReadMesh(path_));
  ASSERT_EQ(points.position.size(), 12u);
  ASSERT_EQ(points.color.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {
    if (points.position[i].x >= 10 && points.position[i].x < 19) {
      EXPECT_LE(Difference(points.color[i], kBlue), 4);
    }
  }
}

TEST_P(MeshFormat, ASurveyIsMadeOfIt) {
  const Workspace workspace = InspectWorkspace(path_);
  ASSERT_EQ(workspace.clouds.size(), 1u);
  EXPECT_EQ(workspace.clouds[0].points, kMeshSamples);
  LoadOptions options;
  options.mesh_samples = 3000;
  Survey survey = LoadSurvey(workspace, options);
  EXPECT_TRUE(survey.dense);
  EXPECT_EQ(survey.points.size(), 3000u);
  EXPECT_EQ(survey.points.normal.size(), 3000u);
  EXPECT_EQ(survey.points.color.size(), 3000u);
  EXPECT_THAT(survey.warnings, IsEmpty());
  EXPECT_EQ(survey.up.has_value(), GetParam().linear);  // glTF says what is up
  options.mesh_samples = 0;
  EXPECT_EQ(LoadSurvey(workspace, options).points.size(), 12u);
  options.decimate_to = 5;
  EXPECT_EQ(LoadSurvey(workspace, options).points.size(), 5u);
  options.mesh_samples.reset();
  EXPECT_EQ(LoadSurvey(workspace, options).points.size(), 5u);
}

// Where the format says how long a file is, every part of one is refused; otherwise some parts are
// whole meshes themselves. Nothing else ever comes out.
TEST_P(MeshFormat, PartsOfAFileAreOneInputError) {
  const std::string whole = ReadFile(path_);
  ASSERT_GT(whole.size(), 100u);
  const std::string part = folder_ + "/part." + GetParam().name;
  int refused = 0, tried = 0;
  for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 60) {
    WriteFile(part, whole.substr(0, length));
    ++tried;
    try {
      PointsAtVertices(ReadMesh(part));
    } catch (const InputError& error) {
      ++refused;
      EXPECT_THAT(error.what(), HasSubstr("/part."));
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  if (GetParam().has_length) {
    EXPECT_EQ(refused, tried);
  } else {
    EXPECT_GT(refused, 0);
  }
}

TEST_P(MeshFormat, MoreThanTheMemoryIsRefused) {
  EXPECT_THROW(ReadMesh(path_, {}, 1000), ResourceError);
  const ImportedMesh mesh = ReadMesh(path_);
  EXPECT_THROW(PointsOnTriangles(mesh, 1'000'000, {}, 10'000'000), ResourceError);
  WritePicture(folder_ + "/one.png", 512, 512, Quarters);
  EXPECT_THROW(PointsOnTriangles(mesh, 100, {}, 100'000), ResourceError);
  EXPECT_EQ(PointsOnTriangles(mesh, 100, {}, 2'000'000).color.size(), 100u);
}

INSTANTIATE_TEST_SUITE_P(All, MeshFormat,
                         ::testing::Values(Format{"obj", nullptr},
                                           Format{"3ds", "3ds", false, true},
                                           Format{"glb", "glb2", true, true},
                                           Format{"gltf", "gltf2", true}, Format{"dae", "collada"},
                                           Format{"fbx", "fbxa"}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace sherd
