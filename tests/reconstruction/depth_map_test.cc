// Depth and normal maps: the files, the points made of them, and which photographs see a point
// where no file says so.
#include "reconstruction/depth_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "metaball/error.h"
#include "reconstruction/geometric_visibility.h"
#include "reconstruction/workspace.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using namespace test;  // NOLINT

std::string MapBytes(int width, int height, int channels,
                     const std::function<float(int column, int row, int channel)>& value) {
  Bytes b;
  for (int k = 0; k < channels; ++k) {
    for (int r = 0; r < height; ++r) {
      for (int c = 0; c < width; ++c) b.Add(value(c, r, k));
    }
  }
  return std::to_string(width) + "&" + std::to_string(height) + "&" + std::to_string(channels) +
         "&" + b.str();
}

TEST(FloatMaps, ArePlanarAndRowAfterRow) {
  const std::string path = TestFolder() + "/m.bin";
  WriteFile(path, MapBytes(5, 3, 3, [](int c, int r, int k) {
              return static_cast<float>(100 * k + 10 * r + c);
            }));
  const FloatMap map = ReadFloatMap(path, 3);
  EXPECT_EQ(map.width, 5);
  EXPECT_EQ(map.height, 3);
  EXPECT_EQ(map.At(4, 2, 1), 124);
  EXPECT_EQ(map.At(0, 1, 2), 210);
  EXPECT_EQ(map.At(3, 0), 3);
  EXPECT_THROW(ReadFloatMap(path, 1), InputError);
  EXPECT_EQ(ReadMapHeader(path).bytes, 6u);
}

TEST(FloatMaps, CutOffAtEveryByteOrWithAHeaderThatLies) {
  const std::string path = TestFolder() + "/m.bin";
  const std::string whole = MapBytes(4, 3, 1, [](int, int, int) { return 1.0f; });
  for (std::size_t length = 0; length < whole.size(); ++length) {
    WriteFile(path, whole.substr(0, length));
    EXPECT_THROW(ReadFloatMap(path, 1), InputError) << length;
  }
  const std::string data = whole.substr(6);
  for (const char* header : {"", "&&&", "4&3&", "4&3&1", "-4&3&1&", "4&3&2&", "0&3&1&",
                             "65537&65537&1&", "99999&99999&3&", "999999999999&1&1&", "4 &3&1&",
                             "4&3&1 &", "0x4&3&1&", "4&4&1&", "ply\n"}) {
    WriteFile(path, header + data);
    EXPECT_THROW(ReadFloatMap(path, 1), InputError) << header;
  }
  WriteFile(path, whole + "x");
  EXPECT_THROW(ReadFloatMap(path, 1), InputError);
}

// The plane z = 4 + 0.25 x, seen by cameras with different intrinsics and map sizes.
struct Plane {
  std::string root = TestFolder();
  TestModel model;
  Vec3d offset{};  // of the whole world
  int map_width = 32, map_height = 20;

  static constexpr double kSlope = 0.25;
  Vec3d Normal() const { return Normalized(Vec3d{kSlope, 0, -1}); }
  // Signed distance from the plane.
  double Distance(const Vec3d& p) const { return Dot(p - offset - Vec3d{0, 0, 4}, Normal()); }

  void AddCamera(const Vec3d& center, double angle, const std::string& name) {
    const auto id = static_cast<std::uint32_t>(model.images.size() + 1);
    model.cameras.push_back({id, CameraModelId::kPinhole, 64, 40, {50, 52, 33, 19}});
    model.images.push_back({id, id, PoseAt(center + offset, angle), name});
  }

  double DepthAt(std::size_t i, int column, int row) const {
    const Rigid3d& pose = model.images[i].pose;
    const double sx = 64.0 / map_width, sy = 40.0 / map_height;
    const Vec3d ray{((column + 0.5) * sx - 33) / 50, ((row + 0.5) * sy - 19) / 52, 1};
    const Vec3d world = pose.InverseRotate(ray);
    return -Distance(pose.Center()) / Dot(world, Normal());
  }

  void Write(bool normals = true) const {
    WriteBinary(root + "/dense/sparse", model);
    for (std::size_t i = 0; i < model.images.size(); ++i) WriteMaps(i, normals, 1.0);
  }

  void WriteMaps(std::size_t i, bool normals, double factor) const {
    const std::string& name = model.images[i].name;
    WriteFile(root + "/dense/stereo/depth_maps/" + name + ".geometric.bin",
              MapBytes(map_width, map_height, 1, [&](int c, int r, int) {
                if (c == 0) return 0.0f;  // nothing is known there
                return static_cast<float>(factor * DepthAt(i, c, r));
              }));
    if (!normals) return;
    const Vec3d n = model.images[i].pose.Rotate(Normal());
    WriteFile(root + "/dense/stereo/normal_maps/" + name + ".geometric.bin",
              MapBytes(map_width, map_height, 3, [&](int, int, int k) {
                return static_cast<float>(k == 0 ? n.x : k == 1 ? n.y : n.z);
              }));
  }

  Survey Load(PointSource source = PointSource::kAuto, std::uint64_t decimate_to = 0) const {
    LoadOptions options;
    options.source = source;
    options.decimate_to = decimate_to;
    return LoadSurvey(InspectWorkspace(root), options);
  }
};

TEST(DepthFusion, OneMapAloneIsTakenAsItIs) {
  Plane plane;
  plane.AddCamera({0.2, 0.1, 0}, 0.2, "sub/one.ppm");
  plane.Write();
  // A picture whose colours say which pixel they are.
  std::string ppm = "P6\n64 40\n255\n";
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 64; ++x) {
      ppm += static_cast<char>(8 * (x / 2));
      ppm += static_cast<char>(12 * (y / 2));
      ppm += '\x20';
    }
  }
  WriteFile(plane.root + "/dense/images/sub/one.ppm", ppm);
  const Workspace w = InspectWorkspace(plane.root);
  EXPECT_EQ(w.depth_maps, 1u) << "in a sub-folder, as the photograph";
  EXPECT_EQ(w.normal_maps, 1u);
  const Survey s = LoadSurvey(w, {});
  EXPECT_TRUE(s.dense);
  EXPECT_EQ(s.dense_pixel_offset, 0) << "pixel centres were kept";
  ASSERT_EQ(s.points.size(), 31u * 20u);
  ASSERT_EQ(s.points.normal.size(), s.points.size());
  const SurveyCamera& camera = s.cameras[0];
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    const int column = 1 + static_cast<int>(i) % 31, row = static_cast<int>(i) / 31;
    const auto p = camera.Project(s.photographs[0].cam_from_world.Apply(s.points.position[i]));
    ASSERT_TRUE(p);
    EXPECT_NEAR(p->first, (column + 0.5) * 2, 1e-9);
    EXPECT_NEAR(p->second, (row + 0.5) * 2, 1e-9);
    EXPECT_NEAR(plane.Distance(s.points.position[i]), 0, 1e-6) << "float depths";
    EXPECT_NEAR(Dot(s.points.normal[i].cast<double>(), plane.Normal()), 1, 1e-6);
    EXPECT_EQ(s.points.color[i], (Rgb8{static_cast<std::uint8_t>(8 * column),
                                       static_cast<std::uint8_t>(12 * row), 0x20}));
    EXPECT_EQ(s.points.photo_begin[i + 1] - s.points.photo_begin[i], 1u);
  }
}

TEST(DepthFusion, MapsThatAgreeBecomeOnePointEachPlace) {
  Plane plane;
  for (int i = 0; i < 4; ++i) {
    plane.AddCamera({-0.3 + 0.2 * i, 0.1 * i, 0}, -0.1 + 0.05 * i,
                    "view " + std::to_string(i) + ".jpg");
  }
  plane.Write();
  const Survey s = plane.Load();
  // About once the area that is seen, not four times.
  EXPECT_GT(s.points.size(), 31u * 20u * 9 / 10);
  EXPECT_LT(s.points.size(), 31u * 20u * 2);
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    EXPECT_NEAR(plane.Distance(s.points.position[i]), 0, 2e-6);
    EXPECT_GE(s.points.photo_begin[i + 1] - s.points.photo_begin[i], 3u);
  }
}

TEST(DepthFusion, WhatOtherMapsContradictIsDropped) {
  Plane plane;
  for (int i = 0; i < 4; ++i) {
    plane.AddCamera({-0.3 + 0.2 * i, 0.1 * i, 0}, -0.1 + 0.05 * i, std::to_string(i) + ".jpg");
  }
  plane.Write();
  plane.WriteMaps(0, true, 1.05);  // five per cent too far
  const Survey s = plane.Load();
  EXPECT_GT(s.points.size(), 400u);
  for (const Vec3d& p : s.points.position) EXPECT_NEAR(plane.Distance(p), 0, 2e-6);
  for (const std::uint32_t photo : s.points.photo_idx) EXPECT_NE(photo, 0u);
  // Two maps that contradict each other leave nothing that could be believed.
  Plane two;
  two.AddCamera({0, 0, 0}, 0, "0.jpg");
  two.AddCamera({0.2, 0, 0}, 0, "1.jpg");
  two.Write();
  two.WriteMaps(1, true, 1.05);
  EXPECT_THROW(two.Load(), InputError);
  // Normals that contradict each other do so too.
  two.WriteMaps(1, true, 1.0);
  EXPECT_GT(two.Load().points.size(), 300u);
  WriteFile(two.root + "/dense/stereo/normal_maps/1.jpg.geometric.bin",
            MapBytes(32, 20, 3, [](int, int, int k) { return k == 1 ? -1.0f : 0.0f; }));
  EXPECT_THROW(two.Load(), InputError);
}

TEST(DepthFusion, WithoutNormalMapsThereAreNoNormals) {
  Plane plane;
  plane.AddCamera({0, 0, 0}, 0, "0.jpg");
  plane.Write(false);
  EXPECT_TRUE(plane.Load().points.normal.empty());
}

TEST(DepthFusion, FarFromTheOriginTheSame) {
  Plane near, far;
  far.offset = {5e5, 4.5e6, 100};
  for (Plane* plane : {&near, &far}) {
    plane->root += plane == &far ? "/far" : "/near";
    for (int i = 0; i < 3; ++i) plane->AddCamera({0.1 * i, 0, 0}, 0.02 * i, std::to_string(i));
    plane->Write();
  }
  const Survey a = near.Load(), b = far.Load();
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_LT(Length(b.points.position[i] - far.offset - a.points.position[i]), 2e-6);
  }
}

TEST(DepthFusion, ThinnedAndCancelled) {
  Plane plane;
  plane.AddCamera({0, 0, 0}, 0, "0.jpg");
  plane.Write();
  const Survey s = plane.Load(PointSource::kAuto, 100);
  EXPECT_LE(s.points.size(), 100u);
  EXPECT_GT(s.points.size(), 30u);
  double left = 0;
  for (const Vec3d& p : s.points.position) left += p.x < 0;
  EXPECT_GT(left, 0.2 * static_cast<double>(s.points.size())) << "spread over the map";
  EXPECT_LT(left, 0.8 * static_cast<double>(s.points.size()));
  std::stop_source source;
  source.request_stop();
  Control control;
  control.stop = source.get_token();
  EXPECT_THROW(LoadSurvey(InspectWorkspace(plane.root), {}, control), Cancelled);
  LoadOptions little;
  little.memory_limit_bytes = 1000;
  EXPECT_THROW(LoadSurvey(InspectWorkspace(plane.root), little), ResourceError);
}

TEST(DepthFusion, MapsStandForTheCloudWhereTheyCoverTheModel) {
  Plane plane;
  for (int i = 0; i < 4; ++i) plane.AddCamera({0.1 * i, 0, 0}, 0, std::to_string(i) + ".jpg");
  plane.model.points.push_back({1, {0, 0, 4}, {1, 2, 3}, 0.5, {1, 2}});
  plane.Write();
  EXPECT_THAT(InspectWorkspace(plane.root).missing,
              Contains(HasSubstr("made from the 4 depth maps")));
  EXPECT_EQ(InspectWorkspace(plane.root + "/dense").preferred, PointSource::kDepthMaps);
  EXPECT_GT(plane.Load().points.size(), 100u);
  EXPECT_EQ(plane.Load(PointSource::kSparse).points.size(), 1u);
  // One of four: not by itself, but when asked for.
  for (const char* name : {"1", "2", "3"}) {
    fs::remove(plane.root + "/dense/stereo/depth_maps/" + name + ".jpg.geometric.bin");
  }
  EXPECT_EQ(plane.Load().points.size(), 1u);
  EXPECT_THAT(InspectWorkspace(plane.root).missing, Contains(HasSubstr("1 of 4 depth maps")));
  EXPECT_EQ(plane.Load(PointSource::kDepthMaps).points.size(), 31u * 20u);
  EXPECT_EQ(plane.Load(PointSource::kDense).points.size(), 31u * 20u) << "there is no cloud";
  // Without any it is said what is not there.
  fs::remove_all(plane.root + "/dense/stereo/depth_maps");
  EXPECT_THROW(plane.Load(PointSource::kDepthMaps), InputError);
}

TEST(DepthFusion, DamagedMapsAreLeftOutInOneLine) {
  Plane plane;
  for (int i = 0; i < 4; ++i) plane.AddCamera({0.1 * i, 0, 0}, 0, std::to_string(i) + ".jpg");
  plane.Write();
  WriteFile(plane.root + "/dense/stereo/depth_maps/0.jpg.geometric.bin", "32&20&1&cut off");
  WriteFile(plane.root + "/dense/stereo/depth_maps/1.jpg.geometric.bin",
            MapBytes(20, 32, 1, [](int, int, int) { return 4.0f; }));  // turned
  WriteFile(plane.root + "/dense/stereo/normal_maps/2.jpg.geometric.bin", "");
  const Survey s = plane.Load();
  EXPECT_GT(s.points.size(), 300u);
  EXPECT_THAT(s.warnings, Contains(HasSubstr("3 depth or normal maps are left out")));
  // Depths that are no numbers are no points.
  Plane bad;
  bad.AddCamera({0, 0, 0}, 0, "0.jpg");
  bad.Write();
  WriteFile(bad.root + "/dense/stereo/depth_maps/0.jpg.geometric.bin",
            MapBytes(32, 20, 1, [](int c, int, int) {
              return c == 3 ? 4.0f : c % 2 ? NAN : c % 4 ? -1.0f : INFINITY;
            }));
  EXPECT_EQ(bad.Load().points.size(), 20u);
}

// --- which photographs see a point ---

// Two walls, one behind the other, cameras on both sides and one that looks away.
struct Walls {
  Survey survey;
  std::size_t front = 0;  // so many points on the wall at z = 4; the others at z = 6

  explicit Walls(bool normals) {
    survey.cameras.push_back({1, CameraModelId::kPinhole, 200, 200, {200, 200, 100, 100}});
    const auto add = [&](const Vec3d& center, double angle) {
      Photograph photo;
      photo.cam_from_world = PoseAt(center, angle);
      survey.photographs.push_back(photo);
    };
    add({0, 0, 0}, 0);
    add({0.5, 0, 0}, 0);
    add({0, 0, 10}, 3.14159265358979);
    add({0, 0, 0}, 3.14159265358979);
    for (const double z : {4.0, 6.0}) {
      for (int i = 0; i < 60; ++i) {
        for (int j = 0; j < 60; ++j) {
          survey.points.position.push_back({(i - 30) * 0.04, (j - 30) * 0.04, z});
          if (normals) survey.points.normal.push_back({0, 0, z == 4 ? -1.0f : 1.0f});
        }
      }
      if (z == 4.0) front = survey.points.size();
    }
  }

  std::vector<std::uint32_t> PhotosOf(std::size_t i) const {
    return {survey.points.photo_idx.begin() + survey.points.photo_begin[i],
            survey.points.photo_idx.begin() + survey.points.photo_begin[i + 1]};
  }
};

TEST(GeometricVisibility, WhatStandsInFrontHides) {
  for (const bool normals : {false, true}) {
    Walls walls(normals);
    const FoundVisibility found = FindVisibility({}, &walls.survey);
    EXPECT_EQ(found.points, walls.survey.points.size());
    EXPECT_EQ(found.seen, walls.survey.points.size());
    using List = std::vector<std::uint32_t>;
    for (std::size_t i = 0; i < walls.survey.points.size(); ++i) {
      // The walls are of one size: the nearer one covers the other.
      EXPECT_EQ(walls.PhotosOf(i), i < walls.front ? (List{0, 1}) : (List{2}))
          << i << " normals " << normals;
    }
  }
}

TEST(GeometricVisibility, OnlyPointsWithoutPhotographsAreGivenSome) {
  Walls walls(true);
  SurveyPoints& points = walls.survey.points;
  points.photo_begin.push_back(0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 2 == 0) points.photo_idx.push_back(3);  // whatever a file says stays
    points.photo_begin.push_back(points.photo_idx.size());
  }
  EXPECT_EQ(FindVisibility({}, &walls.survey).points, points.size() / 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 2 == 0) {
      EXPECT_EQ(walls.PhotosOf(i), std::vector<std::uint32_t>{3});
    } else {
      EXPECT_FALSE(walls.PhotosOf(i).empty());
    }
  }
}

TEST(GeometricVisibility, TheBestPhotographsAreKept) {
  Walls walls(true);
  VisibilityOptions options;
  options.most_photographs = 1;
  FindVisibility(options, &walls.survey);
  for (std::size_t i = 0; i < walls.front; ++i) {
    const std::uint32_t best = walls.survey.points.position[i].x <= 0.25 ? 0 : 1;
    EXPECT_EQ(walls.PhotosOf(i), std::vector<std::uint32_t>{best}) << i;
  }
}

TEST(GeometricVisibility, CloudsWithoutAVisFileGetIt) {
  const std::string root = TestFolder();
  TestModel model;
  model.cameras.push_back({1, CameraModelId::kPinhole, 200, 200, {200, 200, 100, 100}});
  model.images.push_back({1, 1, PoseAt({0, 0, 0}), "a.jpg"});
  WriteBinary(root + "/dense/sparse", model);
  const auto cloud = [&](double z) {
    std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 1600\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n";
    for (int i = 0; i < 1600; ++i) {
      ply += Number(i % 40 * 0.05 - 1) + " " + Number(i / 40 * 0.05 - 1) + " " + Number(z) + "\n";
    }
    WriteFile(root + "/dense/fused.ply", ply);
  };
  cloud(4);
  Survey s = LoadSurvey(InspectWorkspace(root), {});
  EXPECT_EQ(s.points.photo_idx.size(), 1600u);
  EXPECT_THAT(s.warnings, Contains(HasSubstr("found by what hides what, for 100 %")));
  cloud(-4);  // of another frame: nothing of it is in front of the camera
  s = LoadSurvey(InspectWorkspace(root), {});
  EXPECT_TRUE(s.points.photo_begin.empty());
  EXPECT_THAT(s.warnings, Contains(HasSubstr("not of one frame")));
}

}  // namespace
}  // namespace sherd
