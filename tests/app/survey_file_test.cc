#include "app/project/survey_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "app/project/checked_file.h"
#include "metaball/error.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;

std::string MessageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

void ExpectEqual(const Survey& a, const Survey& b) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    EXPECT_EQ(a.cameras[i].camera_id, b.cameras[i].camera_id);
    EXPECT_EQ(a.cameras[i].model, b.cameras[i].model);
    EXPECT_EQ(a.cameras[i].width, b.cameras[i].width);
    EXPECT_EQ(a.cameras[i].height, b.cameras[i].height);
    EXPECT_EQ(a.cameras[i].parameters, b.cameras[i].parameters);
  }
  ASSERT_EQ(a.photographs.size(), b.photographs.size());
  for (std::size_t i = 0; i < a.photographs.size(); ++i) {
    EXPECT_EQ(a.photographs[i].image_id, b.photographs[i].image_id);
    EXPECT_EQ(a.photographs[i].name, b.photographs[i].name);
    EXPECT_EQ(a.photographs[i].path, b.photographs[i].path);
    EXPECT_EQ(a.photographs[i].camera_idx, b.photographs[i].camera_idx);
    EXPECT_EQ(a.photographs[i].original_path, b.photographs[i].original_path);
    EXPECT_EQ(a.photographs[i].original_camera_idx, b.photographs[i].original_camera_idx);
    EXPECT_EQ(a.photographs[i].mask_path, b.photographs[i].mask_path);
    const Rigid3d &p = a.photographs[i].cam_from_world, &q = b.photographs[i].cam_from_world;
    EXPECT_EQ(std::memcmp(&p, &q, sizeof p), 0);
  }
  EXPECT_EQ(a.points.position, b.points.position);
  EXPECT_EQ(a.points.color, b.points.color);
  EXPECT_EQ(a.points.normal, b.points.normal);
  EXPECT_EQ(a.points.error, b.points.error);
  EXPECT_EQ(a.points.photo_begin, b.points.photo_begin);
  EXPECT_EQ(a.points.photo_idx, b.points.photo_idx);
  EXPECT_EQ(a.dense, b.dense);
  EXPECT_EQ(a.dense_pixel_offset, b.dense_pixel_offset);
}

// Every field of a photograph and of the survey set, differently for each photograph.
Survey FullSurvey(int points) {
  Survey survey = testing::WavySurvey(points);
  survey.dense = true;
  survey.dense_pixel_offset = -0.1;
  survey.cameras.push_back({9, CameraModelId::kSimpleRadial, 200, 150, {180, 100, 75, -0.1}});
  for (std::size_t i = 0; i < survey.photographs.size(); ++i) {
    Photograph& photograph = survey.photographs[i];
    photograph.original_path = "../originals/" + photograph.name;
    photograph.original_camera_idx = static_cast<std::uint32_t>((i + 1) % 2);
    if (i % 2 == 0) photograph.mask_path = "m\u00e4sks/" + photograph.name + ".png";
  }
  return survey;
}

// survey.bin as version 1 had it, by the layout in survey_file.h: no mask paths. Every channel.
void WriteVersion1(const std::string& path, const Survey& survey) {
  CheckedWriter out(path, "SHERDSV\n", 1);
  out.Value(static_cast<std::uint32_t>(survey.cameras.size()));
  for (const SurveyCamera& camera : survey.cameras) {
    out.Value(camera.camera_id);
    out.Value(static_cast<std::int32_t>(camera.model));
    out.Value(std::uint64_t{camera.width});
    out.Value(std::uint64_t{camera.height});
    out.Value(static_cast<std::uint32_t>(camera.parameters.size()));
    out.Array(camera.parameters);
  }
  out.Value(static_cast<std::uint32_t>(survey.photographs.size()));
  for (const Photograph& photograph : survey.photographs) {
    const Rigid3d& pose = photograph.cam_from_world;
    out.Value(photograph.image_id);
    out.Value(photograph.camera_idx);
    out.Array(std::vector<double>{pose.qw, pose.qx, pose.qy, pose.qz, pose.translation.x,
                                  pose.translation.y, pose.translation.z});
    out.Text(photograph.name);
    out.Text(photograph.path);
    out.Text(photograph.original_path);
    out.Value(photograph.original_camera_idx);
  }
  const SurveyPoints& points = survey.points;
  out.Value(std::uint64_t{points.size()});
  out.Value(std::uint32_t{1 + 2 + 4 + 8 + 16});
  out.Value(survey.dense_pixel_offset);
  out.Array(points.position);
  out.Array(points.color);
  out.Array(points.normal);
  out.Array(points.error);
  out.Value(std::uint64_t{points.photo_idx.size()});
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.Value(static_cast<std::uint32_t>(points.photo_begin[i + 1] - points.photo_begin[i]));
  }
  out.Array(points.photo_idx);
  out.Commit();
}

TEST(Crc32, KnownValues) {
  EXPECT_EQ(Crc32("123456789", 9), 0xcbf43926u);
  EXPECT_EQ(Crc32("", 0), 0u);
  // In pieces, also such that are no multiple of eight.
  EXPECT_EQ(Crc32("456789", 6, Crc32("123", 3)), 0xcbf43926u);
}

TEST(SurveyFile, KeepsEveryBit) {
  const std::string path = testing::FreshFolder("out") + "/survey.bin";
  Survey survey = FullSurvey(900);
  survey.photographs[2].path = "images/n\u00e4me with blanks.png";
  WriteSurveyFile(path, survey);
  ExpectEqual(ReadSurveyFile(path), survey);
}

TEST(SurveyFile, ReadsVersion1WhichHadNoMasks) {
  const std::string path = testing::FreshFolder("out") + "/survey.bin";
  Survey survey = FullSurvey(900);
  ASSERT_EQ(survey.points.normal.size(), survey.points.size());
  ASSERT_EQ(survey.points.error.size(), survey.points.size());
  WriteVersion1(path, survey);
  for (Photograph& photograph : survey.photographs) photograph.mask_path.clear();
  ExpectEqual(ReadSurveyFile(path), survey);
}

TEST(SurveyFile, ChannelsThatAreMissingStayMissing) {
  const std::string path = testing::FreshFolder("out") + "/survey.bin";
  Survey survey = testing::WavySurvey(25);
  survey.points.normal.clear();
  survey.points.error.clear();
  survey.points.photo_begin.clear();
  survey.points.photo_idx.clear();
  WriteSurveyFile(path, survey);
  ExpectEqual(ReadSurveyFile(path), survey);

  const Survey nothing;
  WriteSurveyFile(path, nothing);
  ExpectEqual(ReadSurveyFile(path), nothing);
}

TEST(SurveyFile, EveryTruncationIsNoticed) {
  const std::string folder = testing::FreshFolder("out");
  WriteSurveyFile(folder + "/survey.bin", testing::WavySurvey(9));
  const std::string whole = testing::ReadText(folder + "/survey.bin");
  for (std::size_t n = 0; n < whole.size(); ++n) {
    testing::WriteText(folder + "/cut.bin", whole.substr(0, n));
    const std::string message = MessageOf([&] { ReadSurveyFile(folder + "/cut.bin"); });
    ASSERT_THAT(message, HasSubstr("cut.bin: byte")) << "cut at " << n;
    ASSERT_THAT(message, HasSubstr("import the survey again")) << "cut at " << n;
  }
  testing::WriteText(folder + "/cut.bin", whole + "x");
  EXPECT_THAT(MessageOf([&] { ReadSurveyFile(folder + "/cut.bin"); }), HasSubstr("cut.bin: byte"));
}

TEST(SurveyFile, EveryChangedByteIsNoticed) {
  const std::string folder = testing::FreshFolder("out");
  WriteSurveyFile(folder + "/survey.bin", testing::WavySurvey(9));
  const std::string whole = testing::ReadText(folder + "/survey.bin");
  std::mt19937 random(7);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ (1 + random() % 255));
    testing::WriteText(folder + "/changed.bin", changed);
    ASSERT_THROW(ReadSurveyFile(folder + "/changed.bin"), InputError) << "byte " << i;
  }
}

TEST(SurveyFile, CountsThatLieAllocateNothing) {
  // A file that claims 2^61 points in a few bytes, with a check sum that fits.
  const std::string path = testing::FreshFolder("out") + "/survey.bin";
  CheckedWriter out(path, "SHERDSV\n", 1);
  out.Value(std::uint32_t{0});
  out.Value(std::uint32_t{0});
  out.Value(std::uint64_t{1} << 61);
  out.Value(std::uint32_t{0});
  out.Commit();
  EXPECT_THAT(MessageOf([&] { ReadSurveyFile(path); }), HasSubstr("ends too early"));
}

TEST(SurveyFile, IndicesMustExist) {
  const std::string path = testing::FreshFolder("out") + "/survey.bin";
  Survey survey = testing::WavySurvey(4);
  survey.points.photo_idx[1] = 4;
  WriteSurveyFile(path, survey);
  EXPECT_THAT(MessageOf([&] { ReadSurveyFile(path); }), HasSubstr("photograph 4 of 4"));
  survey = testing::WavySurvey(4);
  survey.photographs[1].camera_idx = 1;
  WriteSurveyFile(path, survey);
  EXPECT_THAT(MessageOf([&] { ReadSurveyFile(path); }), HasSubstr("camera 1 of 1"));
}

TEST(SurveyFile, NewerVersionIsNamed) {
  const std::string path = testing::FreshFolder("out") + "/survey.bin";
  CheckedWriter out(path, "SHERDSV\n", 3);
  out.Commit();
  EXPECT_THAT(MessageOf([&] { ReadSurveyFile(path); }), HasSubstr("version 3"));
  EXPECT_THAT(MessageOf([&] { ReadSurveyFile(path + ".none"); }), HasSubstr("cannot be opened"));
}

TEST(SurveyFile, ReadingCanBeCancelled) {
  const std::string path = testing::FreshFolder("out") + "/survey.bin";
  WriteSurveyFile(path, testing::WavySurvey(100));
  std::stop_source stop;
  stop.request_stop();
  Control control;
  control.stop = stop.get_token();
  EXPECT_THROW(ReadSurveyFile(path, control), Cancelled);
  EXPECT_THROW(WriteSurveyFile(path + "2", testing::WavySurvey(100), control), Cancelled);
  EXPECT_EQ(testing::ReadText(path + "2"), "");
}

TEST(LevelAttributes, KeepsEveryBitAndChecksTheCounts) {
  const std::string path = testing::FreshFolder("out") + "/attributes.bin";
  Level level;
  level.name = "3";
  level.cloud.center = {{0, 0, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}};
  level.cloud.uniform_radius = 1;
  level.normal = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
  level.photo_begin = {0, 2, 2, 3};
  level.photo_idx = {1, 0, 3};
  level.depth = {0.0f, 0.25f, 1.5f};
  WriteLevelAttributes(path, level);

  Level read;
  read.cloud = level.cloud;
  ReadLevelAttributes(path, 4, &read);
  EXPECT_EQ(read.name, "3");
  EXPECT_EQ(read.normal, level.normal);
  EXPECT_EQ(read.photo_begin, level.photo_begin);
  EXPECT_EQ(read.photo_idx, level.photo_idx);
  EXPECT_EQ(read.depth, level.depth);
  // A survey with fewer photographs, another cloud.
  EXPECT_THAT(MessageOf([&] { ReadLevelAttributes(path, 3, &read); }),
              HasSubstr("photograph 3 of 3"));
  read.cloud.center.pop_back();
  EXPECT_THAT(MessageOf([&] { ReadLevelAttributes(path, 4, &read); }),
              HasSubstr("belongs to 3 metaballs"));
}

TEST(OutlineFile, KeepsThePoints) {
  const std::string path = testing::FreshFolder("out") + "/outline.bin";
  WriteOutlineFile(path, testing::WavyPoints(50));
  EXPECT_EQ(ReadOutlineFile(path), testing::WavyPoints(50));
  WriteOutlineFile(path, {});
  EXPECT_TRUE(ReadOutlineFile(path).empty());
}

}  // namespace
}  // namespace sherd
