// PLY files of all kinds, and fused clouds with their visibility.
#include "reconstruction/ply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "metaball/error.h"
#include "reconstruction/workspace.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;
using namespace test;  // NOLINT

template <class T>
void AddBig(std::string* bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  std::reverse(raw, raw + sizeof(T));
  bytes->append(raw, sizeof(T));
}

// fused.ply as COLMAP writes it: 27 bytes a point.
std::string FusedPly(const std::vector<Vec3f>& positions) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                       std::to_string(positions.size()) +
                       "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
                       "property float ny\nproperty float nz\nproperty uchar red\nproperty uchar "
                       "green\nproperty uchar blue\nend_header\n";
  Bytes b;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Vec3f& p = positions[i];
    b.Add(p.x).Add(p.y).Add(p.z).Add(0.0f).Add(0.0f).Add(-1.0f);
    b.Add<std::uint8_t>(static_cast<std::uint8_t>(i)).Add<std::uint8_t>(50).Add<std::uint8_t>(200);
  }
  return header + b.str();
}

std::string ErrorOf(const std::string& path) {
  try {
    ReadPly(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Ply, Fused) {
  const std::string path = TestFolder() + "/fused.ply";
  WriteFile(path, FusedPly({{1, 2, 3}, {-1.5f, 0, 1e6f}}));
  const PlyHeader header = ReadPlyHeader(path);
  EXPECT_EQ(header.vertices, 2u);
  EXPECT_TRUE(header.has_normals && header.has_colors && !header.has_radius);
  const PlyCloud cloud = ReadPly(path);
  ASSERT_EQ(cloud.position.size(), 2u);
  EXPECT_EQ(cloud.position[1], (Vec3d{-1.5, 0, 1e6}));
  EXPECT_EQ(cloud.color[1], (Rgb8{1, 50, 200}));
  EXPECT_EQ(cloud.normal[0], (Vec3f{0, 0, -1}));
  EXPECT_TRUE(cloud.float_positions);
  EXPECT_TRUE(cloud.radius.empty());
}

TEST(Ply, AsciiWithOtherNamesWindowsLinesListsAndFaces) {
  const std::string path = TestFolder() + "/a.ply";
  WriteFile(path,
            "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nobj_info nothing\r\n"
            "element vertex 2\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\n"
            "property float quality\r\nproperty list uchar int neighbours\r\n"
            "property uint8 diffuse_red\r\nproperty uint8 diffuse_green\r\n"
            "property uint8 diffuse_blue\r\nproperty float normal_x\r\nproperty float normal_y\r\n"
            "property float normal_z\r\nproperty float radius\r\n"
            "element face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
            "500000.0625 4649000.5 1e2 0.5 3 7 8 9 255 128 0 0 1 0 0.25\r\n"
            "-1 -2 -3 0.5 0 1 2 3 1 0 0 4\r\n"
            "3 0 1 0\r\n");
  const PlyCloud cloud = ReadPly(path);
  ASSERT_EQ(cloud.position.size(), 2u);
  EXPECT_EQ(cloud.position[0], (Vec3d{500000.0625, 4649000.5, 100}));
  EXPECT_EQ(cloud.color[0], (Rgb8{255, 128, 0}));
  EXPECT_EQ(cloud.normal[1], (Vec3f{1, 0, 0}));
  EXPECT_EQ(cloud.radius, (std::vector<double>{0.25, 4}));
  EXPECT_EQ(cloud.faces, 1u);
  EXPECT_FALSE(cloud.float_positions);
}

TEST(Ply, BigEndianWithAnElementBeforeTheVertices) {
  const std::string path = TestFolder() + "/b.ply";
  std::string file =
      "ply\nformat binary_big_endian 1.0\nelement camera 2\nproperty list uint16 float values\n"
      "property int16 id\nelement vertex 2\nproperty float64 x\nproperty float32 y\n"
      "property int32 z\nproperty ushort red\nproperty ushort green\nproperty ushort blue\n"
      "end_header\n";
  for (int i = 0; i < 2; ++i) {
    AddBig<std::uint16_t>(&file, static_cast<std::uint16_t>(i));
    for (int j = 0; j < i; ++j) AddBig<float>(&file, 9.0f);
    AddBig<std::int16_t>(&file, -1);
  }
  for (int i = 0; i < 2; ++i) {
    AddBig<double>(&file, 0.1 + i);
    AddBig<float>(&file, -2.5f);
    AddBig<std::int32_t>(&file, -7);
    for (int j = 0; j < 3; ++j) AddBig<std::uint16_t>(&file, j == 1 ? 65535 : 257 * 3);
  }
  WriteFile(path, file);
  const PlyCloud cloud = ReadPly(path);
  ASSERT_EQ(cloud.position.size(), 2u);
  EXPECT_EQ(cloud.position[1], (Vec3d{1.1, -2.5, -7}));
  EXPECT_EQ(cloud.color[0], (Rgb8{3, 255, 3}));
}

TEST(Ply, IntegerColoursAreEncodedFloatColoursLinear) {
  const std::string folder = TestFolder();
  const std::string body = "\nend_header\n0 0 0 ";
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
      "z\n";
  WriteFile(folder + "/f.ply", head +
                                   "property float red\nproperty float green\nproperty float blue" +
                                   body + "0.2158605 0 1\n");
  EXPECT_EQ(ReadPly(folder + "/f.ply").color[0], (Rgb8{128, 0, 255}));
  WriteFile(folder + "/i.ply",
            head + "property uchar r\nproperty uchar g\nproperty uchar b" + body + "128 0 255\n");
  EXPECT_EQ(ReadPly(folder + "/i.ply").color[0], (Rgb8{128, 0, 255}));
}

TEST(Ply, HeadersThatMakeNoSense) {
  const std::string folder = TestFolder();
  const std::string path = folder + "/x.ply";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  struct Case {
    std::string file, place, message;
  };
  const Case cases[] = {
      {"", "line 1", "no PLY file"},
      {"plx\n", "line 1", "no PLY file"},
      {"ply\nformat ascii 1.0\nelement vertex 1\n" + xyz, "line 6", "no end_header"},
      {"ply\nelement vertex 0\n" + xyz + "end_header\n", "line 6", "no format"},
      {"ply\nformat ascii 1.0\nend_header\n", "line 3", "no element 'vertex'"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "line 5",
       "no properties x, y and z"},
      {"ply\nformat ascii 1.0\nelement vertex -1\n", "line 3", "no valid number"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\n", "line 4", "'real'"},
      {"ply\nformat binary 1.0\n", "line 2", "'binary'"},
      {"ply\nformat ascii 1.0\nproperty float x\n", "line 3", "before the first element"},
      {"ply\nformat ascii 1.0\nvertices 5\n", "line 3", "'vertices'"},
      {"ply\nformat ascii 1.0\nelement vertex 99999999999999\n" + xyz + "end_header\n0 0 0\n",
       "byte", "99999999999999"},
      {"ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\n" + xyz +
           "end_header\n0123456789ab",
       "byte", "18446744073709551615"},
      {"ply\nformat ascii 1.0\nelement vertex 1\n" + xyz + "end_header\n0 zero 0\n", "line 8",
       "'zero'"},
      {"ply\nformat ascii 1.0\nelement vertex 1\n" + xyz + "end_header\n0 0 0\n1 1 1\n", "line 9",
       "more vertices"},
      {"ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + xyz +
           "end_header\n0123456789ab0123456789ab",
       "byte", "12 bytes follow"},
  };
  for (const Case& c : cases) {
    WriteFile(path, c.file);
    EXPECT_THAT(ErrorOf(path), HasSubstr(c.place)) << c.file;
    EXPECT_THAT(ErrorOf(path), HasSubstr(c.message)) << c.file;
  }
  EXPECT_THAT(ErrorOf(folder), HasSubstr("no regular file"));
  EXPECT_THAT(ErrorOf(folder + "/none.ply"), HasSubstr("cannot be read"));
}

TEST(Ply, CutOffAtEveryByte) {
  const std::string path = TestFolder() + "/fused.ply";
  const std::string whole = FusedPly({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
  for (std::size_t length = 0; length < whole.size(); ++length) {
    WriteFile(path, whole.substr(0, length));
    EXPECT_THROW(ReadPly(path), InputError) << length;
  }
}

TEST(Ply, DamagedBytes) {
  const std::string path = TestFolder() + "/fused.ply";
  const std::string whole = FusedPly({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
  std::uint64_t state = 3;
  const auto random = [&] {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return state >> 33;
  };
  for (int trial = 0; trial < 2000; ++trial) {
    std::string damaged = whole;
    damaged[random() % damaged.size()] = static_cast<char>(random());
    damaged[random() % 80] = static_cast<char>('0' + random() % 10);
    WriteFile(path, damaged);
    try {
      EXPECT_LT(ReadPly(path).position.size(), 1000u);
    } catch (const InputError&) {
    }
  }
}

// --- fused clouds in their workspace ---

// Points on a plane, each in the left or the right half; two narrow cameras that see a half each,
// and a third that sees nothing of it.
struct DenseFixture {
  std::string root = TestFolder();
  TestModel model;
  std::vector<Vec3f> positions;
  std::vector<std::vector<std::uint32_t>> seen_by_image;  // positions in images.bin

  DenseFixture() {
    model.cameras.push_back({1, CameraModelId::kPinhole, 100, 100, {100, 100, 50, 50}});
    model.images.push_back({9, 1, PoseAt({0, 50, 0}), "z away.png"});
    model.images.push_back({5, 1, PoseAt({-1, 0, 0}), "left.png"});
    model.images.push_back({7, 1, PoseAt({1, 0, 0}), "a right.png"});
    for (int i = 0; i < 40; ++i) {
      const bool left = i % 2 == 0;
      positions.push_back({(left ? -1.0f : 1.0f) + 0.01f * static_cast<float>(i - 20), 0.1f, 4.0f});
      seen_by_image.push_back({left ? 1u : 2u});
    }
    WriteBinary(root + "/dense/sparse", model);
    WriteFile(root + "/dense/fused.ply", FusedPly(positions));
    fs::create_directories(root + "/dense/stereo");
  }

  // order[k]: which image of images.bin index k of the .vis file means.
  void WriteVis(const std::vector<std::uint32_t>& order) const {
    Bytes b;
    b.Add<std::uint64_t>(positions.size());
    for (const auto& seen : seen_by_image) {
      b.Add<std::uint32_t>(static_cast<std::uint32_t>(seen.size()));
      for (const std::uint32_t image : seen) {
        b.Add<std::uint32_t>(static_cast<std::uint32_t>(
            std::find(order.begin(), order.end(), image) - order.begin()));
      }
    }
    WriteFile(root + "/dense/fused.ply.vis", b.str());
  }

  void WriteFrames(const std::vector<std::uint32_t>& image_ids) const {
    Bytes b;
    b.Add<std::uint64_t>(image_ids.size());
    std::uint32_t frame_id = 1;
    for (const std::uint32_t id : image_ids) {
      b.Add(frame_id++).Add<std::uint32_t>(1);
      for (const TestImage& image : model.images) {
        if (image.image_id != id) continue;
        const Rigid3d& p = image.pose;
        for (const double v :
             {p.qw, p.qx, p.qy, p.qz, p.translation.x, p.translation.y, p.translation.z}) {
          b.Add(v);
        }
      }
      b.Add<std::uint32_t>(1).Add<std::int32_t>(0).Add<std::uint32_t>(1).Add<std::uint64_t>(id);
    }
    WriteFile(root + "/dense/sparse/frames.bin", b.str());
  }

  Survey Load() const { return LoadSurvey(InspectWorkspace(root), {}); }

  void ExpectLists(const Survey& s) const {
    ASSERT_EQ(s.points.photo_begin.size(), positions.size() + 1);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      ASSERT_EQ(s.points.photo_begin[i + 1] - s.points.photo_begin[i], 1u);
      const Photograph& photo = s.photographs[s.points.photo_idx[s.points.photo_begin[i]]];
      EXPECT_EQ(photo.image_id, model.images[seen_by_image[i][0]].image_id);
    }
  }
};

TEST(Visibility, IndicesAreTheOrderOfImagesWithoutFrames) {
  DenseFixture f;
  f.WriteVis({0, 1, 2});
  const Survey s = f.Load();
  EXPECT_TRUE(s.dense);
  f.ExpectLists(s);
  EXPECT_EQ(s.dense_pixel_offset, 0.5);
}

TEST(Visibility, IndicesAreTheOrderOfFramesWhereThereAreFrames) {
  DenseFixture f;
  f.WriteFrames({5, 9, 7});
  f.WriteVis({1, 0, 2});
  f.ExpectLists(f.Load());
}

TEST(Visibility, AnOrderThatReprojectionRefutesIsNotBelieved) {
  DenseFixture f;
  f.WriteFrames({5, 9, 7});
  f.WriteVis({0, 1, 2});  // written by a tool that knows nothing of frames
  f.ExpectLists(f.Load());
}

TEST(Visibility, SortedIdsAreRecognised) {
  DenseFixture f;
  f.WriteVis({1, 2, 0});  // ids 5, 7, 9
  f.ExpectLists(f.Load());
}

TEST(Visibility, AFileOfAnotherModelIsLeftOutWithAWarning) {
  DenseFixture f;
  for (auto& seen : f.seen_by_image) seen = {0};
  f.seen_by_image[3] = {1};
  f.seen_by_image[4] = {2};
  f.WriteVis({0, 1, 2});
  const Survey s = f.Load();
  EXPECT_TRUE(s.points.photo_begin.empty());
  EXPECT_EQ(s.points.size(), 40u);
  EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("does not belong to this model")));
}

TEST(Visibility, AnotherNumberOfPointsIsLeftOutWithAWarning) {
  DenseFixture f;
  f.WriteVis({0, 1, 2});
  std::string bytes = ReadFile(f.root + "/dense/fused.ply.vis");
  bytes[0] = 39;
  WriteFile(f.root + "/dense/fused.ply.vis", bytes);
  const Survey s = f.Load();
  EXPECT_TRUE(s.points.photo_begin.empty());
  EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("holds 39 points, but the cloud has 40")));
}

TEST(Visibility, CutOffAtEveryByteStillLoadsThePoints) {
  DenseFixture f;
  f.WriteVis({0, 1, 2});
  const std::string path = f.root + "/dense/fused.ply.vis";
  const std::string whole = ReadFile(path);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    WriteFile(path, whole.substr(0, length));
    const Survey s = f.Load();
    EXPECT_EQ(s.points.size(), 40u);
    EXPECT_TRUE(s.points.photo_begin.empty());
    EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("fused.ply.vis"))) << length;
  }
  // A list longer than the file, one index out of range.
  std::string lie = whole;
  lie[8] = lie[9] = lie[10] = lie[11] = '\x7f';
  WriteFile(path, lie);
  EXPECT_TRUE(f.Load().points.photo_begin.empty());
}

TEST(Visibility, PointsThatAreNotFiniteTakeTheirListsAlong) {
  DenseFixture f;
  f.WriteVis({0, 1, 2});
  f.positions[7].x = NAN;
  WriteFile(f.root + "/dense/fused.ply", FusedPly(f.positions));
  f.positions.erase(f.positions.begin() + 7);
  f.seen_by_image.erase(f.seen_by_image.begin() + 7);
  const Survey s = f.Load();
  f.ExpectLists(s);
  EXPECT_EQ(s.points.color[7].r, 8);
  EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("1 point was dropped")));
}

TEST(Visibility, ThinnedReadingKeepsListsAndColours) {
  DenseFixture f;
  f.WriteVis({0, 1, 2});
  LoadOptions options;
  options.decimate_to = 10;
  const Survey s = LoadSurvey(InspectWorkspace(f.root), options);
  ASSERT_EQ(s.points.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) {
    const std::size_t original = s.points.color[i].r;
    EXPECT_EQ(original / 4, i);
    EXPECT_EQ(s.photographs[s.points.photo_idx[s.points.photo_begin[i]]].image_id,
              f.model.images[f.seen_by_image[original][0]].image_id);
  }
}

TEST(Visibility, HalfAPixelOfASmallerDepthMapIsMore) {
  DenseFixture f;
  f.WriteVis({0, 1, 2});
  WriteFile(f.root + "/dense/stereo/depth_maps/left.png.geometric.bin",
            "25&25&1&" + std::string(4 * 25 * 25, '\0'));
  EXPECT_EQ(f.Load().dense_pixel_offset, 2.0);
}

TEST(Visibility, FloatCoordinatesFarFromTheOriginAreReported) {
  DenseFixture f;
  for (Vec3f& p : f.positions) p.x += 5e5f;
  WriteFile(f.root + "/dense/fused.ply", FusedPly(f.positions));
  EXPECT_THAT(f.Load().warnings, ::testing::Contains(HasSubstr("32-bit numbers")));
}

}  // namespace
}  // namespace sherd
