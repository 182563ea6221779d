// Textures and colours of meshes, in their special cases.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "metaball/error.h"
#include "reconstruction/mesh_import.h"
#include "reconstruction/mesh_points.h"
#include "reconstruction/workspace.h"
#include "tests/reconstruction/mesh_files.h"

namespace sherd {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using namespace test;  // NOLINT

int Difference(Rgb8 a, Rgb8 b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

std::string PictureBytes(const std::string& folder, const std::string& name) {
  WritePicture(folder + "/" + name, 16, 16, Quarters);
  const std::string bytes = ReadFile(folder + "/" + name);
  fs::remove(folder + "/" + name);
  return bytes;
}

constexpr const char* kNodes = "\"nodes\":[{\"mesh\":0}],";
constexpr const char* kTexture = "\"textures\":[{\"source\":0}],";
constexpr const char* kTextured =
    "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}]";
constexpr const char* kEmbeddedPng = "\"images\":[{\"bufferView\":3,\"mimeType\":\"image/png\"}],";

// The sample nearest to a place.
Rgb8 ColorAt(const MeshPoints& points, double x, double y) {
  std::size_t best = 0;
  const auto distance = [&](std::size_t i) {
    return std::hypot(points.position[i].x - x, points.position[i].y - y);
  };
  for (std::size_t i = 1; i < points.position.size(); ++i) {
    if (distance(i) < distance(best)) best = i;
  }
  EXPECT_LT(distance(best), 0.05);
  return points.color.at(best);
}

void ExpectQuarters(const MeshPoints& points, int tolerance) {
  EXPECT_LE(Difference(ColorAt(points, 0.25, 0.75), kRed), tolerance);
  EXPECT_LE(Difference(ColorAt(points, 0.75, 0.75), kGreen), tolerance);
  EXPECT_LE(Difference(ColorAt(points, 0.25, 0.25), kBlue), tolerance);
  EXPECT_LE(Difference(ColorAt(points, 0.75, 0.25), kYellow), tolerance);
}

TEST(MeshTexture, EmbeddedInAGlb) {
  const std::string folder = TestFolder();
  for (const bool png : {true, false}) {
    const std::string images = std::string("\"images\":[{\"bufferView\":3,\"mimeType\":\"image/") +
                               (png ? "png" : "jpeg") + "\"}],";
    WriteFile(folder + "/a.glb", Glb(kNodes + images + kTexture + kTextured,
                                     PictureBytes(folder, png ? "t.png" : "t.jpg")));
    const ImportedMesh mesh = ReadMesh(folder + "/a.glb");
    EXPECT_EQ(mesh.TextureName(), "");  // no file
    const MeshPoints points = PointsOnTriangles(mesh, 3000);
    EXPECT_THAT(points.warnings, IsEmpty());
    ExpectQuarters(points, png ? 1 : 12);
  }
}

TEST(MeshTexture, ADamagedEmbeddedOneIsAWarning) {
  const std::string folder = TestFolder();
  const std::string picture = PictureBytes(folder, "t.png");
  WriteFile(folder + "/a.glb", Glb(kNodes + std::string(kEmbeddedPng) + kTexture + kTextured,
                                   picture.substr(0, picture.size() / 2)));
  const MeshPoints points = PointsOnTriangles(ReadMesh(folder + "/a.glb"), 10);
  EXPECT_THAT(points.warnings, ElementsAre(AllOf(HasSubstr("a.glb"), HasSubstr("cannot be read"))));
  EXPECT_EQ(points.color.size(), 10u);
}

// glTF: factor, vertex colour and texture are multiplied, in linear light.
TEST(MeshTexture, FactorsOfGltfMultiply) {
  const std::string folder = TestFolder();
  const std::string material =
      "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,1,0.25,1],"
      "\"baseColorTexture\":{\"index\":0}}}]";
  WriteFile(folder + "/a.glb", Glb(kNodes + std::string(kEmbeddedPng) + kTexture + material,
                                   PictureBytes(folder, "t.png"), 1, true));
  const MeshPoints points = PointsOnTriangles(ReadMesh(folder + "/a.glb"), 3000);
  const Vec3f red = LinearFromRgb8(kRed);
  EXPECT_LE(Difference(ColorAt(points, 0.25, 0.75),
                       Rgb8FromLinear({red.x * 0.25f, red.y * 0.25f, red.z * 0.25f})),
            1);
}

TEST(MeshTexture, WrapsAsTheMeshSays) {
  const std::string folder = TestFolder();
  const std::string picture = PictureBytes(folder, "t.png");
  // Coordinates from 0 to 2: two repetitions each way.
  const auto read = [&](int mode) {
    const std::string sampler = "\"samplers\":[{\"wrapS\":" + std::to_string(mode) +
                                ",\"wrapT\":" + std::to_string(mode) +
                                "}],\"textures\":[{\"source\":0,\"sampler\":0}],";
    WriteFile(folder + "/a.glb",
              Glb(kNodes + std::string(kEmbeddedPng) + sampler + kTextured, picture, 2));
    return PointsOnTriangles(ReadMesh(folder + "/a.glb"), 20000);
  };
  // u = 2x, and from above t = 2(1 - y). At x = 0.6: u = 1.2; at y = 0.9: t = 0.2.
  const MeshPoints repeat = read(10497), clamp = read(33071), mirror = read(33648);
  EXPECT_LE(Difference(ColorAt(repeat, 0.6, 0.9), kRed), 1);
  EXPECT_LE(Difference(ColorAt(clamp, 0.6, 0.9), kGreen), 1);
  EXPECT_LE(Difference(ColorAt(mirror, 0.6, 0.9), kGreen), 1);
  EXPECT_LE(Difference(ColorAt(repeat, 0.9, 0.9), kGreen), 1);
  EXPECT_LE(Difference(ColorAt(clamp, 0.9, 0.9), kGreen), 1);
  EXPECT_LE(Difference(ColorAt(mirror, 0.9, 0.9), kRed), 1);
  EXPECT_LE(Difference(ColorAt(mirror, 0.9, 0.1), kRed), 1);
  EXPECT_LE(Difference(ColorAt(clamp, 0.9, 0.1), kYellow), 1);
}

TEST(MeshTexture, NodesMoveTurnAndReflect) {
  const std::string folder = TestFolder();
  const std::string nodes =
      "\"nodes\":[{\"children\":[1,2]},{\"mesh\":0,\"translation\":[10,0,0]},"
      "{\"mesh\":0,\"scale\":[-1,1,1]}],";
  WriteFile(folder + "/a.glb", Glb(nodes + std::string(kEmbeddedPng) + kTexture + kTextured,
                                   PictureBytes(folder, "t.png")));
  const MeshPoints points = PointsOnTriangles(ReadMesh(folder + "/a.glb"), 4000);
  int moved = 0;
  for (std::size_t i = 0; i < 4000; ++i) {
    moved += points.position[i].x >= 10;
    // The reflected square still shows the same side: its front is where its triangles turn left.
    EXPECT_NEAR(points.normal[i].z, 1, 1e-6);
  }
  EXPECT_EQ(moved, 2000);
  EXPECT_LE(Difference(ColorAt(points, 10.25, 0.75), kRed), 1);
  EXPECT_LE(Difference(ColorAt(points, -0.25, 0.75), kRed), 1);
}

std::string TexturedObj(const std::string& folder, const std::string& texture) {
  WriteFile(folder + "/a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
            "usemtl m\nf 1/1 2/2 3/3 4/4\n");
  WriteFile(folder + "/a.mtl", "newmtl m\nKd 0.2 0.4 0.6\nmap_Kd " + texture + "\n");
  return folder + "/a.obj";
}

TEST(MeshTexture, IsFoundUnderOtherSpellings) {
  const std::string folder = TestFolder();
  fs::create_directories(folder + "/maps");
  WritePicture(folder + "/maps/the earth.png", 16, 16, Quarters);
  for (const char* name : {"maps/the%20earth.png", "maps\\the%20earth.png"}) {
    const MeshPoints points = PointsOnTriangles(ReadMesh(TexturedObj(folder, name)), 3000);
    EXPECT_THAT(points.warnings, IsEmpty()) << name;
    ExpectQuarters(points, 1);
  }
  // As an old program shortened it, and as it was called on another machine.
  WritePicture(folder + "/Earth.PNG", 16, 16, Quarters);
  for (const char* name : {"EARTH.png", "C:\\work\\earth.png"}) {
    const MeshPoints points = PointsOnTriangles(ReadMesh(TexturedObj(folder, name)), 3000);
    EXPECT_THAT(points.warnings, IsEmpty()) << name;
    ExpectQuarters(points, 1);
  }
}

TEST(MeshTexture, AMissingOneIsNamedOnce) {
  const std::string path = TexturedObj(TestFolder(), "lost.png");
  const MeshPoints points = PointsOnTriangles(ReadMesh(path), 100);
  EXPECT_THAT(points.warnings,
              ElementsAre(AllOf(HasSubstr("a.obj"), HasSubstr("lost.png is missing"))));
  EXPECT_LE(Difference(points.color.at(7), Rgb8{51, 102, 153}), 1);  // the material's colour
}

TEST(MeshTexture, AMissingMaterialFileIsNamedOnce) {
  const std::string path = TexturedObj(TestFolder(), "lost.png");
  fs::rename(fs::path(path).parent_path() / "a.mtl", fs::path(path).parent_path() / "b.mtl");
  const MeshPoints points = PointsOnTriangles(ReadMesh(path), 100);
  EXPECT_THAT(points.warnings, ElementsAre(HasSubstr("a.mtl is missing")));
}

// Between a black and a white pixel lies the middle of the light, not of the numbers.
TEST(MeshTexture, IsBlendedInLinearLight) {
  const std::string folder = TestFolder();
  WritePicture(folder + "/two.png", 2, 1, [](int x, int) {
    const auto v = static_cast<std::uint8_t>(255 * x);
    return Rgb8{v, v, v};
  });
  const MeshPoints points = PointsOnTriangles(ReadMesh(TexturedObj(folder, "two.png")), 100'000);
  const Rgb8 middle = ColorAt(points, 0.5, 0.5);
  EXPECT_NEAR(middle.r, 188, 3);
  EXPECT_LT(ColorAt(points, 0.25, 0.5).r, 30);
}

TEST(MeshTexture, OfAPlyServesItsSamples) {
  const std::string folder = TestFolder();
  WritePicture(folder + "/q.png", 16, 16, Quarters);
  WriteFile(folder + "/a.ply",
            "ply\nformat ascii 1.0\ncomment TextureFile q.png\nelement vertex 4\nproperty float x\n"
            "property float y\nproperty float z\nproperty float s\nproperty float t\n"
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
            "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3\n");
  LoadOptions options;
  const Workspace workspace = InspectWorkspace(folder + "/a.ply");
  EXPECT_EQ(LoadSurvey(workspace, options).points.size(), 4u);  // as a cloud
  options.mesh_samples = 3000;
  const Survey survey = LoadSurvey(workspace, options);
  ASSERT_EQ(survey.points.size(), 3000u);
  MeshPoints points;
  points.position = survey.points.position;
  points.color = survey.points.color;
  ExpectQuarters(points, 1);
}

TEST(MeshTexture, SamplesOfWhatHasNoTrianglesAreRefused) {
  const std::string folder = TestFolder();
  WriteBinary(folder, SmallModel());
  LoadOptions options;
  options.mesh_samples = 100;
  EXPECT_THROW(LoadSurvey(InspectWorkspace(folder), options), InputError);
}

// A mesh beside a model is not taken for its cloud; asked for by name it has the photographs.
TEST(MeshTexture, AMeshOfAWorkspace) {
  const std::string folder = TestFolder();
  WriteBinary(folder + "/sparse/0", SmallModel());
  WriteFile(folder + "/model.off", "OFF\n3 1 0\n0 0 4\n1 0 4\n0 1 4\n3 0 1 2\n");
  const Workspace whole = InspectWorkspace(folder);
  ASSERT_EQ(whole.meshes.size(), 1u);
  EXPECT_FALSE(whole.meshes[0].vertices);
  EXPECT_THAT(whole.clouds, IsEmpty());
  LoadOptions options;
  options.mesh_samples = 500;
  const Survey survey = LoadSurvey(InspectWorkspace(folder + "/model.off"), options);
  EXPECT_EQ(survey.points.size(), 500u);
  EXPECT_EQ(survey.photographs.size(), 3u);
}

}  // namespace
}  // namespace sherd
