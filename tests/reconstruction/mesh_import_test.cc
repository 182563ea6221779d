#include "reconstruction/mesh_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "metaball/error.h"
#include "reconstruction/mesh_points.h"
#include "test_files.h"

namespace sherd {
namespace {

using test::TestFolder;
using test::WriteFile;
using ::testing::HasSubstr;

// A square of four vertices in the plane z = 0, as two triangles.
constexpr const char* kSquare =
    "mtllib square.mtl\nusemtl earth\n"
    "v 0 0 0 1 0 0\nv 2 0 0 0 1 0\nv 2 2 0 0 0 1\nv 0 2 0 1 1 1\n"
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";

std::string WriteSquare(const std::string& folder) {
  WriteFile(folder + "/square.obj", kSquare);
  WriteFile(folder + "/square.mtl", "newmtl earth\nKd 1 1 1\nmap_Kd earth.png\n");
  return folder + "/square.obj";
}

TEST(MeshImportTest, AnObjKeepsColorTextureAndTriangles) {
  const ImportedMesh mesh = ReadMesh(WriteSquare(TestFolder()));
  EXPECT_EQ(mesh.triangle.size(), 2u);
  EXPECT_EQ(mesh.TextureName(), "earth.png");
  ASSERT_EQ(mesh.position.size(), 4u);
  ASSERT_EQ(mesh.color.size(), 4u);
  ASSERT_EQ(mesh.uv.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(mesh.uv[i][0], mesh.position[i].x / 2);
    EXPECT_EQ(mesh.uv[i][1], mesh.position[i].y / 2);
    EXPECT_EQ(mesh.color[i].x == 1, mesh.position[i].x == 0);
  }
}

TEST(MeshImportTest, VerticesBecomeMetaballsOnce) {
  // The edge from (2,0,0) to (2,2,0) has two sets of texture coordinates: six vertices in assimp,
  // four places and two more.
  const std::string path = TestFolder() + "/seam.obj";
  WriteFile(path,
            "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 4 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.5\n"
            "f 1/1 2/2 3/3\nf 2/4 4/1 3/4\n");
  const ImportedMesh mesh = ReadMesh(path);
  EXPECT_EQ(mesh.position.size(), 6u);
  CloudInput input = ToMetaballs(PointsAtVertices(mesh));
  ASSERT_EQ(input.center.size(), 4u);
  input.uniform_radius = 1;
  EXPECT_TRUE(input.color.empty());
  const Cloud cloud = BuildCloud(input);
  ASSERT_EQ(cloud.size(), 4u);
  ASSERT_NE(cloud.FindChannel("uv"), nullptr);
  const Channel* normal = cloud.FindChannel("normal");
  ASSERT_NE(normal, nullptr);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(normal->Get(i).v[2], 1.0f);
}

TEST(MeshImportTest, SamplesAreSpreadByArea) {
  // A triangle of area 1 and one of area 3.
  const std::string path = TestFolder() + "/two.obj";
  WriteFile(path, "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 10 0 0\nv 12 0 0\nv 10 0 3\nf 1 2 3\nf 4 5 6\n");
  const ImportedMesh mesh = ReadMesh(path);
  const CloudInput input = ToMetaballs(PointsOnTriangles(mesh, 4000));
  ASSERT_EQ(input.center.size(), 4000u);
  int small = 0;
  Vec3d sum{};
  for (const Vec3d& p : input.center) {
    if (p.x > 5) {
      EXPECT_EQ(p.y, 0);
      EXPECT_LE((p.x - 10) / 2 + p.z / 3, 1 + 1e-9);
      continue;
    }
    ++small;
    EXPECT_EQ(p.z, 0);
    EXPECT_LE(p.x / 2 + p.y, 1 + 1e-9);
    sum += p;
  }
  EXPECT_EQ(small, 1000);
  // Evenly: the mean is the triangle's centre.
  EXPECT_NEAR(sum.x / small, 2.0 / 3, 0.01);
  EXPECT_NEAR(sum.y / small, 1.0 / 3, 0.005);
  const Channel& normal = input.channels.front();
  EXPECT_EQ(normal.name(), "normal");
  EXPECT_EQ(normal.Get(0).v[2], 1.0f);
  EXPECT_EQ(normal.Get(3999).v[1], -1.0f);
}

TEST(MeshImportTest, SamplesCarryColorAndTextureOfTheirPlace) {
  const std::string path = WriteSquare(TestFolder());
  const CloudInput input = ToMetaballs(PointsOnTriangles(ReadMesh(path), 500));
  ASSERT_EQ(input.color.size(), 500u);
  const Channel& uv = input.channels.back();
  ASSERT_EQ(uv.name(), "uv");
  for (std::size_t i = 0; i < 500; ++i) {
    EXPECT_NEAR(uv.Get(i).v[0], input.center[i].x / 2, 1e-6);
    EXPECT_NEAR(uv.Get(i).v[1], input.center[i].y / 2, 1e-6);
    // Near the white corner all are bright.
    if (input.center[i].x < 0.2 && input.center[i].y > 1.8) {
      EXPECT_GT(input.color[i].r, 220);
      EXPECT_GT(input.color[i].g, 220);
    }
  }
}

TEST(MeshImportTest, AnStlIsRead) {
  const std::string path = TestFolder() + "/t.stl";
  WriteFile(path,
            "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
            "endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\n"
            "vertex 0 1 0\nendloop\nendfacet\nendsolid t\n");
  const ImportedMesh mesh = ReadMesh(path);
  EXPECT_EQ(mesh.triangle.size(), 2u);
  EXPECT_EQ(PointsAtVertices(mesh).position.size(), 4u);
}

TEST(MeshImportTest, BadFilesAreOneInputError) {
  const std::string folder = TestFolder();
  const auto expect_error = [&](const std::string& name, const std::string& bytes,
                                const std::string& what) {
    WriteFile(folder + "/" + name, bytes);
    try {
      ReadMesh(folder + "/" + name);
      ADD_FAILURE() << name;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(name));
      EXPECT_THAT(error.what(), HasSubstr(what));
    }
  };
  expect_error("empty.obj", "", "cannot be read as a mesh");
  expect_error("points.obj", "v 0 0 0\nv 1 0 0\n", "");
  expect_error("far.obj", "v 0 0 0\nv 1 0 0\nf 1 2 99\n", "");
  expect_error("short.stl", std::string(80, ' ') + std::string("\xff\xff\xff\x7f", 4) + "xx",
               "cannot be read as a mesh");
  expect_error("text.off", "OFF\n3 1 0\n0 0 0\n", "");
  EXPECT_THROW(ReadMesh(folder + "/absent.obj"), InputError);
  WriteFile(folder + "/flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  const ImportedMesh flat = ReadMesh(folder + "/flat.obj");
  EXPECT_THROW(PointsOnTriangles(flat, 10), InputError);
  EXPECT_EQ(PointsAtVertices(flat).position.size(), 3u);
}

TEST(MeshImportTest, NamesOfMeshes) {
  for (const char* name : {"a.obj", "A.OBJ", "b.stl", "c.off", "d.3DS", "e.glb", "f.x.gltf"}) {
    EXPECT_TRUE(IsMeshFileName(name));
  }
  for (const char* name : {"a.ply", "b.metaballs", "obj", "c.obj.txt"}) {
    EXPECT_FALSE(IsMeshFileName(name));
  }
}

}  // namespace
}  // namespace sherd
