// The traps of COLMAP's sparse formats that need more than one small model: sub-models, incomplete
// ones, names, ids at the ends of their types, rigs in every form.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "metaball/error.h"
#include "reconstruction/colmap_model.h"
#include "reconstruction/workspace.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using namespace test;  // NOLINT

std::string ErrorOf(const std::string& folder) {
  try {
    LoadSurvey(InspectWorkspace(folder), {});
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ColmapTraps, EverySubModelCanBeChosenTheLargestIsTheDefault) {
  const std::string root = TestFolder();
  for (int i = 0; i < 3; ++i) {
    TestModel m = SmallModel();
    if (i != 2) m.images.resize(i == 0 ? 1 : 2);
    m.points.resize(static_cast<std::size_t>(3 + i));
    i == 1 ? WriteText(root + "/sparse/1", m)
           : WriteBinary(root + "/sparse/" + std::to_string(i), m);
  }
  const Workspace w = InspectWorkspace(root);
  ASSERT_EQ(w.models.size(), 3u);
  EXPECT_EQ(LoadSurvey(w, {}).points.size(), 5u) << "2 has most photographs, not 0";
  for (std::size_t i = 0; i < 3; ++i) {
    LoadOptions options;
    options.model = i;
    const Survey s = LoadSurvey(w, options);
    EXPECT_EQ(s.photographs.size(), w.models[i].images);
    EXPECT_EQ(s.points.size(), w.models[i].points);
    EXPECT_EQ(s.points.size(), 5u - i);
  }
}

TEST(ColmapTraps, AnIncompleteModelSaysWhichFileIsMissing) {
  const char* parts[] = {"cameras", "images", "points3D"};
  for (const bool binary : {true, false}) {
    const std::string extension = binary ? ".bin" : ".txt";
    for (int missing = 1; missing < 7; ++missing) {
      const std::string root = TestFolder();
      const std::string folder = root + "/sparse/0";
      binary ? WriteBinary(folder, SmallModel()) : WriteText(folder, SmallModel());
      for (int k = 0; k < 3; ++k) {
        if (missing >> k & 1) fs::remove(folder + "/" + parts[k] + extension);
      }
      const std::string error = ErrorOf(folder);
      for (int k = 0; k < 3; ++k) {
        const std::string name = parts[k] + extension;
        if (missing >> k & 1) {
          EXPECT_THAT(error, HasSubstr(name)) << missing;
        } else {
          EXPECT_THAT(error, Not(HasSubstr(name))) << missing;
        }
      }
      EXPECT_THAT(error, HasSubstr("sparse model is incomplete"));
    }
  }
}

TEST(ColmapTraps, ACompleteTextModelBesideARestOfABinaryOneIsRead) {
  const std::string folder = TestFolder();
  WriteText(folder, SmallModel());
  WriteFile(folder + "/cameras.bin", CamerasBin(SmallModel()));
  EXPECT_EQ(LoadSurvey(InspectWorkspace(folder), {}).points.size(), 12u);
}

TEST(ColmapTraps, NamesAsTheyAre) {
  const std::vector<std::string> names = {"a photo with  two blanks.jpg",
                                          "sub folder/deep er/x.png",
                                          "Grabung \xc3\xbc\xc3\xa4\xe5\x86\x99.jpg",
                                          "123",
                                          "# no comment.jpg",
                                          "1 2 3.jpg"};
  TestModel m = SmallModel();
  m.images.resize(1);
  m.points.clear();
  m.points.push_back({1, {0, 0, 4}, {1, 2, 3}, 0.5, {30}});
  const TestImage image = m.images[0];
  m.images.clear();
  for (std::size_t i = 0; i < names.size(); ++i) {
    m.images.push_back(image);
    m.images.back().image_id = static_cast<std::uint32_t>(30 + i);
    m.images.back().name = names[i];
  }
  std::vector<std::string> sorted = names;
  std::sort(sorted.begin(), sorted.end());
  for (const bool binary : {true, false}) {
    const std::string folder = TestFolder();
    binary ? WriteBinary(folder, m) : WriteText(folder, m);
    const Survey s = LoadSurvey(InspectWorkspace(folder), {});
    ASSERT_EQ(s.photographs.size(), names.size());
    for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(s.photographs[i].name, sorted[i]);
  }
  // Blanks at the end of the line are no part of it.
  const std::string folder = TestFolder();
  WriteText(folder, m);
  std::string text = ReadFile(folder + "/images.txt");
  text.insert(text.find("two blanks.jpg") + 14, " \t ");
  WriteFile(folder + "/images.txt", text);
  EXPECT_EQ(LoadSurvey(InspectWorkspace(folder), {}).photographs[4].name, names[0]);
}

// Exact to the last one of each type: nothing goes through a double.
TEST(ColmapTraps, IdsAtTheEndsOfTheirTypes) {
  TestModel m = SmallModel();
  m.cameras[0].camera_id = 4294967295u;
  for (TestImage& image : m.images) {
    if (image.camera_id == 7) image.camera_id = 4294967295u;
  }
  m.images[0].image_id = 4294967295u;
  m.images[1].image_id = 4294967293u;
  m.images[2].image_id = 0;
  for (TestPoint& p : m.points) p.images = {4294967295u, 4294967293u, 0};
  m.points[0].id = UINT64_MAX - 1;
  m.points[1].id = 0;
  m.points[2].id = (1ull << 53) + 1;
  for (const bool binary : {true, false}) {
    const std::string folder = TestFolder();
    binary ? WriteBinary(folder, m) : WriteText(folder, m);
    const Survey s = LoadSurvey(InspectWorkspace(folder), {});
    ASSERT_EQ(s.photographs.size(), 3u);
    EXPECT_EQ(s.photographs[0].image_id, 4294967295u);
    EXPECT_EQ(s.photographs[1].image_id, 0u);
    EXPECT_EQ(s.photographs[2].image_id, 4294967293u);
    EXPECT_EQ(s.points.photo_idx.size(), 36u);
    EXPECT_THAT(s.warnings, Not(Contains(HasSubstr("not in the model"))));
  }
}

TEST(ColmapTraps, NumbersBeyondTheirTypeAreRefusedByName) {
  struct Case {
    const char *file, *from, *to, *expected;
  };
  for (const Case& c :
       {Case{"cameras.txt", "7 PINHOLE", "4294967296 PINHOLE", "CAMERA_ID"},
        Case{"cameras.txt", "7 PINHOLE", "-1 PINHOLE", "CAMERA_ID"},
        Case{"cameras.txt", "640", "6.4e2", "WIDTH"},
        Case{"images.txt", "30 ", "4294967296 ", "IMAGE_ID"},
        Case{"points3D.txt", " 20 100", " 256 100", "R"},
        Case{"points3D.txt", "18446744073709551614", "18446744073709551616", "POINT3D_ID"}}) {
    const std::string folder = TestFolder();
    WriteText(folder, SmallModel());
    std::string text = ReadFile(folder + "/" + c.file);
    const std::size_t at = text.find(c.from);
    ASSERT_NE(at, std::string::npos) << c.from;
    text.replace(at, std::strlen(c.from), c.to);
    WriteFile(folder + "/" + c.file, text);
    const std::string error = ErrorOf(folder);
    EXPECT_THAT(error, HasSubstr(std::string("is no valid number for ") + c.expected));
    EXPECT_THAT(error, HasSubstr("line "));
  }
}

TEST(ColmapTraps, OneIdIsOneRecord) {
  for (const bool binary : {true, false}) {
    TestModel m = SmallModel();
    m.cameras.push_back(m.cameras[0]);
    const std::string folder = TestFolder();
    binary ? WriteBinary(folder, m) : WriteText(folder, m);
    EXPECT_THAT(ErrorOf(folder), HasSubstr("camera 7: the same id appears twice"));
    m = SmallModel();
    m.images[1].image_id = 30;
    binary ? WriteBinary(folder, m) : WriteText(folder, m);
    EXPECT_THAT(ErrorOf(folder), HasSubstr("image 30: the same id appears twice"));
  }
}

// The frames of a model whose images were registered in another order, with everything a rig can
// hold: an IMU without a pose, a camera without one, a rig without sensors, data in no order.
struct RigFiles {
  std::string bin_rigs, bin_frames, txt_rigs, txt_frames;

  RigFiles() {
    Bytes rigs, frames;
    rigs.Add<std::uint64_t>(3);
    rigs.Add<std::uint32_t>(9).Add<std::uint32_t>(0);
    rigs.Add<std::uint32_t>(1).Add<std::uint32_t>(4).Add<std::int32_t>(0).Add<std::uint32_t>(7);
    rigs.Add<std::int32_t>(1).Add<std::uint32_t>(1).Add<std::uint8_t>(0);
    rigs.Add<std::int32_t>(0).Add<std::uint32_t>(8).Add<std::uint8_t>(0);
    rigs.Add<std::int32_t>(0).Add<std::uint32_t>(4294967294u).Add<std::uint8_t>(1);
    const Rigid3d side = PoseAt({1, 0, 0}, 0.1);
    AddPose(side, &rigs);
    rigs.Add<std::uint32_t>(2).Add<std::uint32_t>(1).Add<std::int32_t>(0).Add<std::uint32_t>(7);
    frames.Add<std::uint64_t>(2);
    frames.Add<std::uint32_t>(3).Add<std::uint32_t>(2);
    AddPose(PoseAt({1, 0, 0}), &frames);
    frames.Add<std::uint32_t>(1).Add<std::int32_t>(0).Add<std::uint32_t>(7).Add<std::uint64_t>(2);
    frames.Add<std::uint32_t>(4).Add<std::uint32_t>(1);
    AddPose(PoseAt({-1, 0, 0}), &frames);
    frames.Add<std::uint32_t>(3);
    frames.Add<std::int32_t>(0).Add<std::uint32_t>(4294967294u).Add<std::uint64_t>(4294967294u);
    frames.Add<std::int32_t>(1).Add<std::uint32_t>(1).Add<std::uint64_t>(1ull << 40);
    frames.Add<std::int32_t>(0).Add<std::uint32_t>(7).Add<std::uint64_t>(30);
    bin_rigs = rigs.str();
    bin_frames = frames.str();
    txt_rigs = "# rigs\n9 0\n1 4 CAMERA 7 IMU 1 0 CAMERA 8 0 CAMERA 4294967294 1" + Text(side) +
               "\n2 1 CAMERA 7\n";
    txt_frames = "3 2" + Text(PoseAt({1, 0, 0})) + " 1 CAMERA 7 2\n4 1" + Text(PoseAt({-1, 0, 0})) +
                 " 3 CAMERA 4294967294 4294967294 IMU 1 1099511627776 CAMERA 7 30\n";
  }

  static std::vector<double> Values(const Rigid3d& p) {
    return {p.qw, p.qx, p.qy, p.qz, p.translation.x, p.translation.y, p.translation.z};
  }
  static void AddPose(const Rigid3d& p, Bytes* b) {
    for (const double v : Values(p)) b->Add(v);
  }
  static std::string Text(const Rigid3d& p) {
    std::string t;
    for (const double v : Values(p)) t += " " + Number(v);
    return t;
  }
};

TEST(ColmapTraps, FramesGiveTheOrderOfTheirDataSorted) {
  const RigFiles files;
  for (const bool binary : {true, false}) {
    const std::string folder = TestFolder();
    binary ? WriteBinary(folder, SmallModel()) : WriteText(folder, SmallModel());
    WriteFile(folder + (binary ? "/rigs.bin" : "/rigs.txt"),
              binary ? files.bin_rigs : files.txt_rigs);
    WriteFile(folder + (binary ? "/frames.bin" : "/frames.txt"),
              binary ? files.bin_frames : files.txt_frames);
    const ColmapModel model = ReadColmapModel(folder, binary, {}, {});
    EXPECT_THAT(model.warnings, IsEmpty());
    // By frame, then by sensor: camera 7 before camera 2^32 - 2; the IMU shows nothing.
    EXPECT_THAT(model.frame_image_ids, ElementsAre(2u, 30u, 4294967294u));
  }
}

TEST(ColmapTraps, DamagedRigsAreLeftOutWithAWarning) {
  const RigFiles files;
  const std::string folder = TestFolder();
  WriteBinary(folder, SmallModel());
  WriteFile(folder + "/rigs.bin", files.bin_rigs.substr(0, 30));
  WriteFile(folder + "/frames.bin", files.bin_frames);
  const Survey s = LoadSurvey(InspectWorkspace(folder), {});
  EXPECT_EQ(s.points.size(), 12u);
  EXPECT_THAT(s.warnings, Contains(HasSubstr("rigs and frames are left out")));
  // Rigs without frames say nothing.
  fs::remove(folder + "/frames.bin");
  EXPECT_THAT(ReadColmapModel(folder, true, {}, {}).warnings, IsEmpty());
}

}  // namespace
}  // namespace sherd
