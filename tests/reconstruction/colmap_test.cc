// Sparse models: both forms, the traps of the formats, damage of every kind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "metaball/error.h"
#include "reconstruction/workspace.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;
using namespace test;  // NOLINT: the helpers of these tests

Survey Load(const std::string& path) {
  LoadOptions options;
  options.source = PointSource::kSparse;
  return LoadSurvey(InspectWorkspace(path), options);
}

std::string ErrorOf(const std::string& path) {
  try {
    Load(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

void ExpectIsSmallModel(const Survey& s) {
  const TestModel m = SmallModel();
  ASSERT_EQ(s.cameras.size(), m.cameras.size());
  for (std::size_t i = 0; i < m.cameras.size(); ++i) {
    EXPECT_EQ(s.cameras[i].camera_id, m.cameras[i].camera_id);
    EXPECT_EQ(s.cameras[i].model, m.cameras[i].model);
    EXPECT_EQ(s.cameras[i].width, m.cameras[i].width);
    EXPECT_EQ(s.cameras[i].height, m.cameras[i].height);
    EXPECT_EQ(s.cameras[i].parameters, m.cameras[i].parameters);
  }
  ASSERT_EQ(s.photographs.size(), m.images.size());
  const std::size_t by_name[] = {0, 2, 1};
  for (std::size_t i = 0; i < m.images.size(); ++i) {
    const Photograph& photo = s.photographs[i];
    const TestImage& image = m.images[by_name[i]];
    EXPECT_EQ(photo.image_id, image.image_id);
    EXPECT_EQ(photo.name, image.name);
    EXPECT_EQ(s.cameras[photo.camera_idx].camera_id, image.camera_id);
    EXPECT_NEAR(photo.cam_from_world.qw, image.pose.qw, 1e-15);
    EXPECT_EQ(photo.cam_from_world.translation, image.pose.translation);
  }
  ASSERT_EQ(s.points.size(), m.points.size());
  ASSERT_EQ(s.points.photo_begin.size(), m.points.size() + 1);
  for (std::size_t i = 0; i < m.points.size(); ++i) {
    EXPECT_EQ(s.points.position[i], m.points[i].position);
    EXPECT_EQ(s.points.color[i], m.points[i].color);
    EXPECT_EQ(s.points.error[i], static_cast<float>(m.points[i].error));
    std::vector<std::uint32_t> ids;
    for (std::uint64_t j = s.points.photo_begin[i]; j < s.points.photo_begin[i + 1]; ++j) {
      ids.push_back(s.photographs[s.points.photo_idx[j]].image_id);
    }
    EXPECT_THAT(ids, ::testing::UnorderedElementsAreArray(m.points[i].images));
  }
}

TEST(Colmap, BinaryRoundTrip) {
  const std::string folder = TestFolder();
  WriteBinary(folder, SmallModel());
  ExpectIsSmallModel(Load(folder));
}

TEST(Colmap, TextRoundTrip) {
  const std::string folder = TestFolder();
  WriteText(folder, SmallModel());
  ExpectIsSmallModel(Load(folder));
}

TEST(Colmap, BinaryIsPreferredWhereBothAreThere) {
  const std::string folder = TestFolder();
  WriteText(folder, SmallModel());
  TestModel fewer = SmallModel();
  fewer.points.resize(5);
  WriteBinary(folder, fewer);
  EXPECT_EQ(Load(folder).points.size(), 5u);
}

TEST(Colmap, EveryCameraModelInBothForms) {
  for (int id = 0; id < 18; ++id) {
    TestModel m = SmallModel();
    const int n = *NumParameters(id);
    SurveyCamera& camera = m.cameras[0];
    camera.model = static_cast<CameraModelId>(id);
    camera.parameters.clear();
    for (int i = 0; i < n; ++i) camera.parameters.push_back(100.0 + i + 1.0 / 3);
    for (const bool binary : {true, false}) {
      const std::string folder = TestFolder();
      binary ? WriteBinary(folder, m) : WriteText(folder, m);
      const Survey s = Load(folder);
      EXPECT_EQ(s.cameras[0].parameters, camera.parameters) << id;
      EXPECT_EQ(static_cast<int>(s.cameras[0].model), id);
    }
  }
  EXPECT_FALSE(NumParameters(-1));
  EXPECT_FALSE(NumParameters(18));
}

TEST(Colmap, TextWithWindowsLineEndsCommentsAndNoLastLine) {
  const std::string folder = TestFolder();
  const auto windows = [](std::string text) {
    std::string out;
    for (const char c : text) out += c == '\n' ? std::string("\r\n") : std::string(1, c);
    return out;
  };
  const TestModel m = SmallModel();
  WriteFile(folder + "/cameras.txt", "\xef\xbb\xbf# made on Windows\r\n" + windows(CamerasTxt(m)));
  // The last image has observations; its line and the end of the header's line are cut off.
  std::string images = windows(ImagesTxt(m));
  images.resize(images.find("right.jpg") + 9);
  WriteFile(folder + "/images.txt", images);
  std::string points = windows(PointsTxt(m));
  points.resize(points.size() - 2);
  WriteFile(folder + "/points3D.txt", "\r\n# comment\r\n  " + points);
  ExpectIsSmallModel(Load(folder));
}

TEST(Colmap, TheLineAfterAnImageIsItsOwnEvenIfItLooksLikeAComment) {
  const std::string folder = TestFolder();
  TestModel m = SmallModel();
  WriteText(folder, m);
  std::string images = ReadFile(folder + "/images.txt");
  const std::size_t line = images.find("10.5");
  images.replace(line, images.find('\n', line) - line, "# nothing was matched");
  WriteFile(folder + "/images.txt", images);
  ExpectIsSmallModel(Load(folder));
}

TEST(Colmap, TextWithoutObservationLinesIsRefusedNotHalved) {
  const std::string folder = TestFolder();
  TestModel m = SmallModel();
  WriteText(folder, m);
  std::string images;
  for (const TestImage& i : m.images) {
    images += std::to_string(i.image_id) + " 1 0 0 0 0 0 0 7 " + i.name + "\n";
  }
  WriteFile(folder + "/images.txt", images);
  EXPECT_THAT(ErrorOf(folder), HasSubstr("images.txt: line 2"));
  EXPECT_THAT(ErrorOf(folder), HasSubstr("empty line"));
}

TEST(Colmap, DecimalCommaIsNamed) {
  const std::string folder = TestFolder();
  WriteText(folder, SmallModel());
  const std::string points = PointsTxt(SmallModel());
  std::string with_comma = points;
  with_comma[with_comma.find("0.5", points.find('\n')) + 1] = ',';
  WriteFile(folder + "/points3D.txt", with_comma);
  EXPECT_THAT(ErrorOf(folder), HasSubstr("points3D.txt: line 2"));
  EXPECT_THAT(ErrorOf(folder), HasSubstr("decimal comma"));
}

TEST(Colmap, UnknownCameraIdInBinaryIsAHardErrorThatHelps) {
  const std::string folder = TestFolder();
  WriteBinary(folder, SmallModel());
  std::string cameras = CamerasBin(SmallModel());
  const std::int32_t unknown = 99;
  std::memcpy(&cameras[12], &unknown, 4);
  WriteFile(folder + "/cameras.bin", cameras);
  EXPECT_THAT(ErrorOf(folder), HasSubstr("cameras.bin: byte 8"));
  EXPECT_THAT(ErrorOf(folder), HasSubstr("unknown model id 99"));
  EXPECT_THAT(ErrorOf(folder), HasSubstr("model_converter --output_type TXT"));
}

TEST(Colmap, UnknownCameraNameInTextLosesOnlyThatCamera) {
  const std::string folder = TestFolder();
  WriteText(folder, SmallModel());
  std::string cameras = CamerasTxt(SmallModel());
  cameras.replace(cameras.find("PINHOLE"), 7, "HYPERBOLIC");
  WriteFile(folder + "/cameras.txt", cameras);
  const Survey s = Load(folder);
  ASSERT_EQ(s.photographs.size(), 1u);
  EXPECT_EQ(s.photographs[0].name, "sub/middle.png");
  EXPECT_EQ(s.points.size(), 12u);
  for (const std::uint32_t i : s.points.photo_idx) EXPECT_EQ(i, 0u);
  EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("HYPERBOLIC")));
  EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("2 photographs were dropped")));
}

TEST(Colmap, PhotographsWithoutCameraAreDroppedInOneLine) {
  const std::string folder = TestFolder();
  TestModel m = SmallModel();
  m.cameras.pop_back();
  WriteBinary(folder, m);
  const Survey s = Load(folder);
  EXPECT_EQ(s.photographs.size(), 2u);
  EXPECT_EQ(s.points.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(s.points.photo_begin[i + 1] - s.points.photo_begin[i], i == 4 ? 0u : 2u);
  }
  EXPECT_EQ(std::count_if(s.warnings.begin(), s.warnings.end(),
                          [](const std::string& w) {
                            return w.find("camera is not in the model") != std::string::npos;
                          }),
            1);
}

TEST(Colmap, PointsThatAreNotFiniteAreDroppedAndCounted) {
  TestModel m = SmallModel();
  m.points[2].position.y = NAN;
  m.points[7].position.x = INFINITY;
  for (const bool binary : {true, false}) {
    const std::string folder = TestFolder();
    binary ? WriteBinary(folder, m) : WriteText(folder, m);
    const Survey s = Load(folder);
    EXPECT_EQ(s.points.size(), 10u);
    EXPECT_EQ(s.points.photo_begin.size(), 11u);
    EXPECT_EQ(s.points.photo_begin.back(), s.points.photo_idx.size());
    EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("2 points were dropped")));
  }
}

TEST(Colmap, QuaternionsAreMadeUnitAndZeroIsRefused) {
  TestModel m = SmallModel();
  const std::string folder = TestFolder();
  m.images[0].pose.qw *= 3;
  WriteBinary(folder, m);
  EXPECT_NEAR(Load(folder).photographs[0].cam_from_world.qw, 1, 1e-15);
  m.images[0].pose.qw = 0;
  WriteBinary(folder, m);
  EXPECT_THAT(ErrorOf(folder), HasSubstr("images.bin: byte 8"));
  m.images[0].pose.qw = 1;
  m.images[0].pose.translation.z = NAN;
  WriteBinary(folder, m);
  EXPECT_THAT(ErrorOf(folder), HasSubstr("not finite"));
}

TEST(Colmap, ImpossibleCamerasAreRefused) {
  const std::string folder = TestFolder();
  TestModel m = SmallModel();
  WriteBinary(folder, m);
  m.cameras[0].parameters[0] = 0;
  WriteFile(folder + "/cameras.bin", CamerasBin(m));
  EXPECT_THAT(ErrorOf(folder), HasSubstr("focal length"));
  m.cameras[0].parameters[0] = NAN;
  WriteFile(folder + "/cameras.bin", CamerasBin(m));
  EXPECT_THAT(ErrorOf(folder), HasSubstr("not finite"));
  m = SmallModel();
  m.cameras[0].width = 0;
  WriteFile(folder + "/cameras.bin", CamerasBin(m));
  EXPECT_THAT(ErrorOf(folder), HasSubstr("impossible size"));
  m = SmallModel();
  m.cameras[1].camera_id = 7;
  WriteFile(folder + "/cameras.bin", CamerasBin(m));
  EXPECT_THAT(ErrorOf(folder), HasSubstr("twice"));
}

TEST(Colmap, EmptyTracksMeanNothingIsKnown) {
  const std::string folder = TestFolder();
  TestModel m = SmallModel();
  for (TestPoint& p : m.points) p.images.clear();
  WriteBinary(folder, m);
  const Survey s = Load(folder);
  EXPECT_EQ(s.points.size(), 12u);
  EXPECT_TRUE(s.points.photo_begin.empty());
}

TEST(Colmap, TracksMayNameUnknownImagesAndRepeatThemselves) {
  const std::string folder = TestFolder();
  TestModel m = SmallModel();
  m.points[0].images = {30, 30, 999, 2, 30};
  WriteBinary(folder, m);
  const Survey s = Load(folder);
  EXPECT_EQ(s.points.photo_begin[1], 2u);
  EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("1 observation names a photograph")));
}

// A count that lies must be found out before memory is asked for: a 2^60 of anything would throw
// bad_alloc or length_error, which is no InputError.
TEST(Colmap, CountsThatLieAreFoundBeforeAnythingIsAllocated) {
  const TestModel m = SmallModel();
  struct File {
    const char* name;
    std::string bytes;
    std::size_t count_at;
  };
  const std::string images = ImagesBin(m), points = PointsBin(m);
  const File files[] = {
      {"cameras.bin", CamerasBin(m), 0},
      {"images.bin", images, 0},
      {"images.bin", images, 8 + 4 + 56 + 4 + 13},  // observations of "left one.jpg"
      {"points3D.bin", points, 0},
      {"points3D.bin", points, 8 + 8 + 24 + 3 + 8},  // the first track
  };
  for (const File& file : files) {
    for (const std::uint64_t lie : {std::uint64_t{1} << 60, UINT64_MAX, std::uint64_t{100000}}) {
      const std::string folder = TestFolder();
      WriteBinary(folder, m);
      std::string bytes = file.bytes;
      std::memcpy(&bytes[file.count_at], &lie, 8);
      WriteFile(folder + "/" + file.name, bytes);
      EXPECT_THAT(ErrorOf(folder), HasSubstr(file.name)) << file.count_at << " " << lie;
    }
    // Too few: bytes are left over.
    const std::string folder = TestFolder();
    WriteBinary(folder, m);
    WriteFile(folder + "/" + file.name, file.bytes + "x");
    EXPECT_THAT(ErrorOf(folder), HasSubstr("follow the last")) << file.name;
  }
}

std::string RigsBin() {
  Bytes b;
  b.Add<std::uint64_t>(2);
  b.Add<std::uint32_t>(1).Add<std::uint32_t>(1).Add<std::int32_t>(0).Add<std::uint32_t>(7);
  b.Add<std::uint32_t>(2).Add<std::uint32_t>(2).Add<std::int32_t>(0).Add<std::uint32_t>(7);
  b.Add<std::int32_t>(0).Add<std::uint32_t>(4294967294u).Add<std::uint8_t>(1);
  const Rigid3d p = PoseAt({1, 0, 0}, 0.1);  // middle camera from left camera
  for (const double v :
       {p.qw, p.qx, p.qy, p.qz, p.translation.x, p.translation.y, p.translation.z}) {
    b.Add(v);
  }
  return b.str();
}

std::string FramesBin(double shift) {
  Bytes b;
  const auto pose = [&](const Rigid3d& p) {
    for (const double v :
         {p.qw, p.qx, p.qy, p.qz, p.translation.x, p.translation.y, p.translation.z}) {
      b.Add(v);
    }
  };
  b.Add<std::uint64_t>(2);
  b.Add<std::uint32_t>(1).Add<std::uint32_t>(1);
  pose(PoseAt({1 + shift, 0, 0}));
  b.Add<std::uint32_t>(1).Add<std::int32_t>(0).Add<std::uint32_t>(7).Add<std::uint64_t>(2);
  b.Add<std::uint32_t>(2).Add<std::uint32_t>(2);
  pose(PoseAt({-1 + shift, 0, 0}));
  b.Add<std::uint32_t>(2);
  b.Add<std::int32_t>(0).Add<std::uint32_t>(4294967294u).Add<std::uint64_t>(4294967294u);
  b.Add<std::int32_t>(0).Add<std::uint32_t>(7).Add<std::uint64_t>(30);
  return b.str();
}

TEST(Colmap, RigsAndFramesAgreeOrWarnOnce) {
  const std::string folder = TestFolder();
  WriteBinary(folder, SmallModel());
  WriteFile(folder + "/rigs.bin", RigsBin());
  WriteFile(folder + "/frames.bin", FramesBin(0));
  Survey s = Load(folder);
  ExpectIsSmallModel(s);
  EXPECT_EQ(s.warnings.size(), 1u) << "only the photographs are missing";
  WriteFile(folder + "/frames.bin", FramesBin(0.5));
  s = Load(folder);
  ExpectIsSmallModel(s);
  EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("3 photographs have another pose")));
}

TEST(Colmap, FramesInTextForm) {
  const std::string folder = TestFolder();
  WriteText(folder, SmallModel());
  const auto pose = [](const Rigid3d& p) {
    std::string t;
    for (const double v :
         {p.qw, p.qx, p.qy, p.qz, p.translation.x, p.translation.y, p.translation.z}) {
      t += " " + Number(v);
    }
    return t;
  };
  WriteFile(folder + "/rigs.txt", "# rigs\n1 1 CAMERA 7\n2 2 CAMERA 7 CAMERA 4294967294 1" +
                                      pose(PoseAt({1, 0, 0}, 0.1)) + "\n");
  WriteFile(folder + "/frames.txt", "1 1" + pose(PoseAt({2, 0, 0})) + " 1 CAMERA 7 2\n2 2" +
                                        pose(PoseAt({-1, 0, 0})) +
                                        " 2 CAMERA 7 30 CAMERA 4294967294 4294967294\n");
  const Survey s = Load(folder);
  ExpectIsSmallModel(s);
  EXPECT_THAT(s.warnings, ::testing::Contains(HasSubstr("1 photographs have another pose")));
}

// Cut off at every byte: an InputError or a survey, never anything else.
TEST(Colmap, CutOffAtEveryByte) {
  const TestModel m = SmallModel();
  for (const bool binary : {true, false}) {
    const std::string folder = TestFolder();
    binary ? WriteBinary(folder, m) : WriteText(folder, m);
    if (binary) {
      WriteFile(folder + "/rigs.bin", RigsBin());
      WriteFile(folder + "/frames.bin", FramesBin(0));
    }
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) {
      names.push_back(entry.path().filename().string());
    }
    for (const std::string& name : names) {
      const std::string whole = ReadFile(folder + "/" + name);
      int refused = 0;
      for (std::size_t length = 0; length < whole.size(); ++length) {
        WriteFile(folder + "/" + name, whole.substr(0, length));
        try {
          const Survey s = Load(folder);
          EXPECT_LE(s.points.size(), m.points.size());
          for (const std::uint32_t i : s.points.photo_idx) ASSERT_LT(i, s.photographs.size());
        } catch (const InputError&) {
          ++refused;
        }
      }
      // A binary file of the model is never usable in part; rigs and frames are only a hint.
      if (binary && name != "rigs.bin" && name != "frames.bin") {
        EXPECT_EQ(refused, static_cast<int>(whole.size())) << name;
      }
      WriteFile(folder + "/" + name, whole);
    }
  }
}

// Bytes changed at random: nothing but an InputError or a survey.
TEST(Colmap, DamagedBytes) {
  const TestModel m = SmallModel();
  std::uint64_t state = 1;
  const auto random = [&] {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return state >> 33;
  };
  for (const bool binary : {true, false}) {
    const std::string folder = TestFolder();
    binary ? WriteBinary(folder, m) : WriteText(folder, m);
    const char* extension = binary ? ".bin" : ".txt";
    for (int trial = 0; trial < 600; ++trial) {
      const std::string name = std::string(trial % 3 == 0   ? "cameras"
                                           : trial % 3 == 1 ? "images"
                                                            : "points3D") +
                               extension;
      const std::string whole = ReadFile(folder + "/" + name);
      std::string damaged = whole;
      for (int k = 0; k < 3; ++k) {
        damaged[random() % damaged.size()] = static_cast<char>(random());
      }
      WriteFile(folder + "/" + name, damaged);
      try {
        const Survey s = Load(folder);
        for (const std::uint32_t i : s.points.photo_idx) ASSERT_LT(i, s.photographs.size());
      } catch (const InputError&) {
      }
      WriteFile(folder + "/" + name, whole);
    }
  }
}

TEST(Colmap, ThinnedReadingKeepsTheListsWithTheirPoints) {
  const std::string folder = TestFolder();
  TestModel m = SmallModel();
  m.points.clear();
  for (int i = 0; i < 1000; ++i) {
    TestPoint p;
    p.id = static_cast<std::uint64_t>(i);
    p.position = {static_cast<double>(i), 0, 5};
    p.error = i;
    p.images = {i % 2 ? 30u : 2u};
    m.points.push_back(p);
  }
  for (const bool binary : {true, false}) {
    binary ? WriteBinary(folder, m) : WriteText(folder, m);
    LoadOptions options;
    options.decimate_to = 100;
    const Survey s = LoadSurvey(InspectWorkspace(folder), options);
    ASSERT_EQ(s.points.size(), 100u);
    for (std::size_t i = 0; i < 100; ++i) {
      const int original = static_cast<int>(s.points.position[i].x);
      EXPECT_EQ(original / 10, static_cast<int>(i)) << "one of each tenth";
      EXPECT_EQ(s.points.error[i], static_cast<float>(original));
      EXPECT_EQ(s.photographs[s.points.photo_idx[s.points.photo_begin[i]]].image_id,
                original % 2 ? 30u : 2u);
    }
    fs::remove(folder + "/cameras.bin");
  }
}

TEST(Colmap, TooLargeForMemoryIsRefusedWithFigures) {
  const std::string folder = TestFolder();
  WriteBinary(folder, SmallModel());
  LoadOptions options;
  options.memory_limit_bytes = 100;
  try {
    LoadSurvey(InspectWorkspace(folder), options);
    FAIL() << "was loaded";
  } catch (const ResourceError& error) {
    EXPECT_GT(error.needed(), 100u);
    EXPECT_EQ(error.available(), 100u);
    EXPECT_THAT(error.what(), HasSubstr("decimation"));
  }
}

TEST(Colmap, CanBeCancelled) {
  const std::string folder = TestFolder();
  WriteBinary(folder, SmallModel());
  std::stop_source source;
  source.request_stop();
  Control control;
  control.stop = source.get_token();
  EXPECT_THROW(LoadSurvey(InspectWorkspace(folder), {}, control), Cancelled);
}

}  // namespace
}  // namespace sherd
