// Meshes as files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "metaball/error.h"
#include "metaball/mesh/mesh.h"
#include "test_scenes.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class MeshFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("sherd_mesh_file_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    CloudInput input = testing::OneMetaball({500000.125, 4649776.25, 128.5}, 1.0);
    input.color = {{200, 100, 50}};
    Channel uv("uv", ChannelType::kFloat32, 2, 1);
    uv.Set(0, {{0.25f, 0.75f, 0, 0}});
    input.channels = {uv};
    textured_ = ExtractMesh(testing::SceneOf(input, 0.25), {0.3, 0});
    plain_ = textured_;
    plain_.uv.clear();
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  std::string Bytes(const std::string& name) const {
    std::ifstream in(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  fs::path folder_;
  SurfaceMesh plain_, textured_;
};

TEST_F(MeshFileTest, PlyHoldsEveryDigit) {
  for (const bool textured : {false, true}) {
    const SurfaceMesh& mesh = textured ? textured_ : plain_;
    WritePlyMesh(Path("m.ply"), mesh, "sheet.png");
    const std::string bytes = Bytes("m.ply");
    const std::size_t body = bytes.find("end_header\n") + 11;
    const std::string header = bytes.substr(0, body);
    EXPECT_THAT(header, HasSubstr("format binary_little_endian 1.0\n"));
    EXPECT_THAT(header, HasSubstr("element vertex " + std::to_string(mesh.position.size())));
    EXPECT_THAT(header, HasSubstr("property double x\n"));
    EXPECT_EQ(header.find("comment TextureFile sheet.png\n") != std::string::npos, textured);
    EXPECT_EQ(header.find("property float s\n") != std::string::npos, textured);
    const std::size_t stride = 24 + 12 + 3 + (textured ? 8 : 0);
    ASSERT_EQ(bytes.size(), body + stride * mesh.position.size() + 13 * mesh.triangle.size());
    for (std::size_t i = 0; i < mesh.position.size(); ++i) {
      const char* at = bytes.data() + body + i * stride;
      Vec3d p;
      Vec3f n;
      std::memcpy(&p, at, 24);
      std::memcpy(&n, at + 24, 12);
      EXPECT_EQ(p, mesh.position[i]);
      EXPECT_EQ(n, mesh.normal[i]);
      EXPECT_EQ(static_cast<std::uint8_t>(at[stride - 3]), mesh.color[i].r);
    }
    const char* at = bytes.data() + bytes.size() - 13;
    std::array<std::uint32_t, 3> last;
    EXPECT_EQ(*at, 3);
    std::memcpy(&last, at + 1, 12);
    EXPECT_EQ(last, mesh.triangle.back());
  }
}

TEST_F(MeshFileTest, ObjHoldsEveryDigitAndItsTexture) {
  for (const bool textured : {false, true}) {
    const SurfaceMesh& mesh = textured ? textured_ : plain_;
    WriteObjMesh(Path("m.obj"), mesh, "sheet.png");
    EXPECT_EQ(fs::exists(folder_ / "m.mtl"), textured);
    std::istringstream in(Bytes("m.obj"));
    std::string word, rest;
    std::size_t vertices = 0, normals = 0, uvs = 0, faces = 0;
    while (in >> word) {
      if (word == "v") {
        double x, y, z, r, g, b;
        in >> x >> y >> z >> r >> g >> b;
        EXPECT_EQ((Vec3d{x, y, z}), mesh.position[vertices]);
        EXPECT_NEAR(r * 255, mesh.color[vertices++].r, 1e-3);
      } else if (word == "f") {
        const std::uint32_t corner = mesh.triangle[faces++][0] + 1;
        const std::string c = std::to_string(corner);
        in >> rest;
        EXPECT_EQ(rest, textured ? c + "/" + c + "/" + c : c + "//" + c);
      }
      normals += word == "vn";
      uvs += word == "vt";
      std::getline(in, rest);
    }
    EXPECT_EQ(vertices, mesh.position.size());
    EXPECT_EQ(normals, mesh.normal.size());
    EXPECT_EQ(uvs, mesh.uv.size());
    EXPECT_EQ(faces, mesh.triangle.size());
    if (textured) {
      EXPECT_THAT(Bytes("m.obj"), HasSubstr("mtllib m.mtl\nusemtl surface\n"));
      EXPECT_THAT(Bytes("m.mtl"), HasSubstr("map_Kd sheet.png\n"));
    }
  }
}

TEST_F(MeshFileTest, FailingToWriteLeavesNothing) {
  EXPECT_THROW(WritePlyMesh(Path("no/m.ply"), plain_), OutputError);
  EXPECT_THROW(WriteObjMesh(Path("no/m.obj"), textured_, "sheet.png"), OutputError);
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace sherd
