// Transforms between frames, and coordinates far from the origin.
#include "reconstruction/similarity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "metaball/error.h"
#include "reconstruction/workspace.h"
#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;
using namespace test;  // NOLINT

std::string Written(const std::string& text) {
  const std::string path = TestFolder() + "/transform.txt";
  WriteFile(path, text);
  return path;
}

std::string ErrorOf(const std::string& text) {
  try {
    ReadSimilarity(Written(text));
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Similarity, AsModelAlignerWritesIt) {
  // Half a turn about z; the last bit of every number counts.
  const Similarity3d s = ReadSimilarity(
      Written("0.12345678901234567 0 0 0 1 4321987.1234567891 500000.00000000006 -3e-7\n"));
  EXPECT_EQ(s.scale, 0.12345678901234567);
  EXPECT_EQ(s.rotation_and_translation.qz, 1);
  EXPECT_EQ(s.rotation_and_translation.translation,
            (Vec3d{4321987.1234567891, 500000.00000000006, -3e-7}));
  const Vec3d p = s.Apply({1, 2, 3});
  EXPECT_NEAR(p.x, 4321987.1234567891 - s.scale, 1e-9);
  EXPECT_NEAR(p.y, 500000.00000000006 - 2 * s.scale, 1e-9);
  EXPECT_NEAR(p.z, 3 * s.scale - 3e-7, 1e-12);
}

TEST(Similarity, AsAMatrix) {
  // A quarter turn about z, twice as large.
  const std::string rows = "0 -2 0 10\n2 0 0 20\n0 0 2 30\n";
  for (const std::string& text : {rows, "# comment\n" + rows + "0 0 0 1\n"}) {
    const Similarity3d s = ReadSimilarity(Written(text));
    EXPECT_NEAR(s.scale, 2, 1e-15);
    EXPECT_LT(Length(s.Apply({1, 0, 5}) - Vec3d{10, 22, 40}), 1e-14);
  }
}

TEST(Similarity, OneAfterAnother) {
  const Similarity3d first = ReadSimilarity(Written("0.5 0.5 0.5 -0.5 0.5 100 -20 3"));
  const Similarity3d second = ReadSimilarity(Written("3 0.6 0 0.8 0 -7 8 9"));
  const Similarity3d both = Compose(second, first);
  EXPECT_EQ(both.scale, 1.5);
  for (const Vec3d& p : {Vec3d{0, 0, 0}, Vec3d{1, 2, 3}, Vec3d{-40, 5, 0.5}}) {
    EXPECT_LT(Length(both.Apply(p) - second.Apply(first.Apply(p))), 1e-12);
  }
}

TEST(Similarity, ATurnHasAnAngle) {
  EXPECT_EQ(TurnOf({}), 0);
  EXPECT_NEAR(TurnOf({std::cos(0.3), 0, std::sin(0.3), 0, {4, 5, 6}}), 0.6, 1e-12);
  // The other quaternion of the same turn; the shorter way of a long one; half a turn.
  EXPECT_NEAR(TurnOf({-std::cos(0.3), 0, -std::sin(0.3), 0, {}}), 0.6, 1e-12);
  EXPECT_NEAR(TurnOf({std::cos(2.0), std::sin(2.0), 0, 0, {}}), 2 * std::acos(-1.0) - 4, 1e-12);
  EXPECT_NEAR(TurnOf({0, 0, 0, 1, {}}), std::acos(-1.0), 1e-12);
  // Small ones keep their digits.
  EXPECT_NEAR(TurnOf({std::cos(5e-9), 5e-9, 0, 0, {}}), 1e-8, 1e-20);
}

TEST(Similarity, WhatIsNoneIsRefused) {
  EXPECT_THAT(ErrorOf(""), HasSubstr("holds 0 numbers"));
  EXPECT_THAT(ErrorOf("1 1 0 0 0 0 0"), HasSubstr("holds 7 numbers"));
  EXPECT_THAT(ErrorOf("1 1 0 0 0 0 0 x"), HasSubstr("line 1"));
  EXPECT_THAT(ErrorOf("1,5 1 0 0 0 0 0 0"), HasSubstr("decimal comma"));
  EXPECT_THAT(ErrorOf("0 1 0 0 0 0 0 0"), HasSubstr("scale is not positive"));
  EXPECT_THAT(ErrorOf("1 0 0 0 0 0 0 0"), HasSubstr("no quaternion"));
  EXPECT_THAT(ErrorOf("1 1 0 0 0 0 0 inf"), HasSubstr("not finite"));
  EXPECT_THAT(ErrorOf("1 0 0 0 0 1 0 0 0 0 2 0"), HasSubstr("no rotation"));
  EXPECT_THAT(ErrorOf("1 0 0 0 0 1 0 0 0 0 -1 0"), HasSubstr("no rotation"));
  EXPECT_THAT(ErrorOf("1 0 0 0 0 1 0 0 0 0 1 0 1 0 0 1"), HasSubstr("no rotation"));
  EXPECT_THAT(ErrorOf(std::string(70000, '1')), HasSubstr("far too large"));
  EXPECT_THROW(ReadSimilarity(TestFolder() + "/none"), InputError);
}

Survey SmallSurvey() {
  const std::string folder = TestFolder();
  WriteBinary(folder, SmallModel());
  Survey survey = LoadSurvey(InspectWorkspace(folder), {});
  survey.points.normal.assign(survey.points.size(), {0, 0, -1});
  return survey;
}

// Into an earth-centred frame and what is seen stays where it was seen, to a millionth of a pixel:
// a double there resolves a nanometre.
TEST(Similarity, EverythingProjectsWhereItDid) {
  const Survey before = SmallSurvey();
  Similarity3d s;
  s.scale = 3.75;
  s.rotation_and_translation = {0.5, -0.5, 0.5, 0.5, {4075539.8, 931735.3, 4801629.4}};
  Survey after = before;
  after.metres_per_unit = 3.75;
  TransformSurvey(s, &after);
  EXPECT_DOUBLE_EQ(*after.metres_per_unit, 1);
  EXPECT_NEAR(Dot(*after.up, s.rotation_and_translation.Rotate(*before.up)), 1, 1e-12);
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    for (std::size_t k = 0; k < before.photographs.size(); ++k) {
      const SurveyCamera& camera = before.cameras[before.photographs[k].camera_idx];
      const auto a =
          camera.Project(before.photographs[k].cam_from_world.Apply(before.points.position[i]));
      const auto b =
          camera.Project(after.photographs[k].cam_from_world.Apply(after.points.position[i]));
      ASSERT_TRUE(a && b);
      EXPECT_NEAR(a->first, b->first, 1e-6);
      EXPECT_NEAR(a->second, b->second, 1e-6);
    }
    const Vec3d n =
        after.photographs[0].cam_from_world.Rotate(after.points.normal[i].cast<double>());
    const Vec3d m =
        before.photographs[0].cam_from_world.Rotate(before.points.normal[i].cast<double>());
    EXPECT_LT(Length(n - m), 1e-6);
  }
  const double d = Length(before.points.position[0] - before.points.position[9]);
  EXPECT_NEAR(Length(after.points.position[0] - after.points.position[9]), 3.75 * d, 1e-8);
}

// Coordinates of the size of UTM and ECEF are read to the last bit from every form of model.
TEST(Georeferenced, CoordinatesAreReadWithoutALoss) {
  TestModel m = SmallModel();
  const Vec3d offset{4075539.812345678, 10931735.312345678, 481629.4123456789};
  for (TestPoint& p : m.points) p.position = p.position + offset;
  for (TestImage& image : m.images) {
    image.pose.translation = -image.pose.Rotate(image.pose.Center() + offset);
  }
  for (const bool binary : {true, false}) {
    const std::string folder = TestFolder();
    binary ? WriteBinary(folder, m) : WriteText(folder, m);
    const Survey s = LoadSurvey(InspectWorkspace(folder), {});
    for (std::size_t i = 0; i < m.points.size(); ++i) {
      EXPECT_EQ(s.points.position[i], m.points[i].position);
    }
    for (const TestImage& image : m.images) {
      for (const Photograph& photo : s.photographs) {
        if (photo.image_id != image.image_id) continue;
        EXPECT_EQ(photo.cam_from_world.translation, image.pose.translation);
      }
    }
  }
  // A cloud with doubles too, without a warning.
  const std::string root = TestFolder();
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 12\nproperty double x\nproperty double y\nproperty "
      "double z\nend_header\n";
  for (const TestPoint& p : m.points) {
    ply += Number(p.position.x) + " " + Number(p.position.y) + " " + Number(p.position.z) + "\n";
  }
  WriteFile(root + "/scan.ply", ply);
  const Survey s = LoadSurvey(InspectWorkspace(root), {});
  for (std::size_t i = 0; i < m.points.size(); ++i) {
    EXPECT_EQ(s.points.position[i], m.points[i].position);
  }
  EXPECT_THAT(s.warnings, ::testing::Not(::testing::Contains(HasSubstr("32-bit"))));
}

}  // namespace
}  // namespace sherd
