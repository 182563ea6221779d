// Levelling: a ground of known tilt among things that stand on it.
#include "reconstruction/ground_plane.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "metaball/error.h"
#include "reconstruction/level.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

// An excavation 10 wide whose ground is z = 0 with 1 cm of noise, and a share of it that is
// something else: walls, a heap of stones on it, and strays all around.
Survey Excavation(double clutter, bool normals) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> noise(0, 0.01);
  Survey survey;
  constexpr int kPoints = 30000;
  for (int i = 0; i < kPoints; ++i) {
    Vec3d p{10 * unit(random), 10 * unit(random), noise(random)};
    Vec3f n{0, 0, 1};
    if (unit(random) < clutter) {
      const double kind = unit(random);
      if (kind < 0.6) {  // a wall
        p = {0 + noise(random), p.y, 4 * unit(random)};
        n = {1, 0, 0};
      } else if (kind < 0.9) {  // a heap
        const double angle = 2 * std::numbers::pi * unit(random), up = unit(random);
        const double out = std::sqrt(1 - up * up);
        n = Vec3d{out * std::cos(angle), out * std::sin(angle), up}.cast<float>();
        p = Vec3d{7, 7, 0} + 1.5 * n.cast<double>();
      } else {  // strays
        p = Vec3d{unit(random), unit(random), unit(random)} * 60.0 - Vec3d{25, 25, 25};
        n = Normalized(p).cast<float>();
      }
    }
    survey.points.position.push_back(p);
    if (normals) survey.points.normal.push_back(n);
  }
  for (int i = 0; i < 8; ++i) {
    Photograph photo;  // looks down: x right, y to the south
    photo.cam_from_world = {0, 1, 0, 0, {}};
    photo.cam_from_world.translation = -photo.cam_from_world.Rotate({1.0 * i, 10.0 - i, 5});
    survey.photographs.push_back(photo);
  }
  return survey;
}

// Turned by `degrees` about a slanting axis, then moved.
Similarity3d Tilt(double degrees, const Vec3d& move) {
  const Vec3d axis = Normalized(Vec3d{0.6, -0.8, 0.1}) * std::sin(degrees * kDegree / 2);
  Similarity3d tilt;
  tilt.rotation_and_translation = {std::cos(degrees * kDegree / 2), axis.x, axis.y, axis.z, move};
  return tilt;
}

double AngleDeg(const Vec3d& a, const Vec3d& b) {
  return std::atan2(Length(Cross(a, b)), Dot(a, b)) / kDegree;
}

struct Case {
  const char* name;
  double tilt_deg, clutter, tolerance_deg;
  bool normals, up;
  Vec3d move;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Ground : public ::testing::TestWithParam<Case> {};

TEST_P(Ground, IsFoundAndLevelled) {
  const Case& c = GetParam();
  const Survey level = Excavation(c.clutter, c.normals);
  Survey survey = level;
  const Similarity3d tilt = Tilt(c.tilt_deg, c.move);
  TransformSurvey(tilt, &survey);
  const Vec3d truth = tilt.rotation_and_translation.Rotate({0, 0, 1});
  GroundOptions options;
  // As photographs tell it: ten degrees wrong.
  if (c.up) {
    options.up = Normalized(truth + std::tan(10 * kDegree) *
                                        tilt.rotation_and_translation.Rotate({0.8, -0.6, 0}));
  }
  const GroundPlane ground = FindGround(survey.points, options, "test");
  EXPECT_LT(AngleDeg(ground.normal, truth), c.tolerance_deg);
  EXPECT_EQ(ground.by_normals, c.up && c.normals);
  EXPECT_NEAR(ground.rms, 0.01, 0.01);
  EXPECT_GT(ground.share, 1 - c.clutter - 0.02);
  const GroundPlane again = FindGround(survey.points, options, "test");
  EXPECT_EQ(again.normal, ground.normal);
  EXPECT_EQ(again.point, ground.point);

  const Similarity3d upright = LevelWith(ground);
  TransformSurvey(upright, &survey);
  EXPECT_EQ(upright.scale, 1);
  const Vec3d n = upright.rotation_and_translation.Rotate(ground.normal);
  EXPECT_LT(Length(n - Vec3d{0, 0, 1}), 1e-12);
  const Vec3d middle = upright.Apply(ground.point);
  EXPECT_NEAR(middle.x, ground.point.x, 1e-8);
  EXPECT_NEAR(middle.y, ground.point.y, 1e-8);
  EXPECT_NEAR(middle.z, 0, 1e-8);
  // Heights are those over the ground, in coordinates of millions too, within what the tilt that is
  // left lifts the far corner by; and what a photograph saw it sees at the same place.
  const double lift = 15 * std::sin(c.tolerance_deg * kDegree) + 0.01;
  for (std::size_t i = 0; i < level.points.size(); i += 97) {
    const Vec3d& p = level.points.position[i];
    if (std::abs(p.x) < 12 && std::abs(p.y) < 12 && std::abs(p.z) < 12) {
      ASSERT_NEAR(survey.points.position[i].z, p.z, lift);
    }
    for (std::size_t k = 0; k < level.photographs.size(); ++k) {
      const Vec3d before = level.photographs[k].cam_from_world.Apply(p);
      const Vec3d after = survey.photographs[k].cam_from_world.Apply(survey.points.position[i]);
      ASSERT_LT(Length(before - after), 1e-7);
    }
    if (c.normals) {
      ASSERT_LT(
          Length(
              level.photographs[0].cam_from_world.Rotate(level.points.normal[i].cast<double>()) -
              survey.photographs[0].cam_from_world.Rotate(survey.points.normal[i].cast<double>())),
          1e-6);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Ground,
    ::testing::Values(Case{"Level", 0, 0, 0.01, true, true, {}},
                      Case{"Tilted", 17, 0.4, 0.05, true, true, {3, -4, 5}},
                      Case{"MostlyClutter", 40, 0.8, 0.1, true, true, {}},
                      Case{"WithoutNormals", 25, 0.5, 0.1, false, true, {}},
                      Case{"UpsideDown", 180, 0.3, 0.05, true, true, {}},
                      Case{"NothingSaysWhatIsUp", 130, 0.3, 0.05, true, false, {}},
                      Case{
                          "InANationalGrid", 5, 0.3, 0.05, true, true, {653412.25, 6861234.5, 87}}),
    [](const auto& test) { return std::string(test.param.name); });

std::string ErrorOf(const SurveyPoints& points, const GroundOptions& options) {
  try {
    FindGround(points, options, "dig.sherd");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(GroundRefused, WhereNoPlaneHoldsEnough) {
  GroundOptions options;
  options.up = Vec3d{0, 0, 1};
  SurveyPoints ball, cube;
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 20000; ++i) {
    const Vec3d n = Normalized(Vec3d{normal(random), normal(random), normal(random)});
    ball.position.push_back(n * 5.0);
    ball.normal.push_back(n.cast<float>());
    cube.position.push_back({unit(random), unit(random), unit(random)});
  }
  EXPECT_THAT(ErrorOf(ball, options), HasSubstr("dig.sherd: no ground to level"));
  EXPECT_THAT(ErrorOf(ball, options), HasSubstr("--ground-tolerance"));
  EXPECT_THAT(ErrorOf(cube, options), HasSubstr("no ground to level"));
  EXPECT_THAT(ErrorOf(cube, {}), HasSubstr("no ground to level"));
  // With more allowed there is one.
  options.tolerance = 0.3;
  EXPECT_EQ(ErrorOf(cube, options), "no error");
}

TEST(GroundRefused, AWallIsNoGround) {
  SurveyPoints wall;
  for (int i = 0; i < 10000; ++i) {
    wall.position.push_back({0.01 * (i % 100), 0.001 * (i % 7), 0.01 * (i / 100)});
    wall.normal.push_back({0, -1, 0});
  }
  GroundOptions options;
  options.up = Vec3d{0, 0, 1};
  EXPECT_THAT(ErrorOf(wall, options), HasSubstr("no ground to level"));
  wall.normal.clear();
  EXPECT_THAT(ErrorOf(wall, options), HasSubstr("no ground to level"));
  options.up = Vec3d{0, -1, 0};  // as a floor it is
  EXPECT_EQ(ErrorOf(wall, options), "no error");
}

TEST(GroundRefused, ToleranceAndPoints) {
  EXPECT_THAT(ErrorOf({}, {}), HasSubstr("no ground to level"));
  GroundOptions options;
  for (const double wrong : {0.0, -1.0, std::nan("")}) {
    options.tolerance = wrong;
    EXPECT_THAT(ErrorOf({}, options), HasSubstr("above 0"));
  }
}

// Metaballs, their normals and lists of photographs go together, in whatever order they come out.
TEST(TransformLevel, MovesWhatBelongsTogether) {
  CloudInput input;
  Level level;
  level.name = "x";
  level.photo_begin = {0};
  const Vec3d far{653412.25, 6861234.5, 87};
  std::vector<std::uint32_t> order;
  for (int i = 0; i < 500; ++i) {
    input.center.push_back(far + Vec3d{0.1 * (i % 10), 0.1 * (i / 10 % 10), 0.1 * (i / 100)});
    input.radius.push_back(0.1 + 0.001 * i);
    input.color.push_back({static_cast<std::uint8_t>(i % 256), 0, 7});
  }
  level.cloud = BuildCloud(input, nullptr, &order);
  for (const std::uint32_t i : order) {  // whose numbers all say which metaball it is
    const double a = 0.01 * i;
    level.normal.push_back(Vec3d{std::cos(a), std::sin(a), 0}.cast<float>());
    level.depth.push_back(static_cast<float>(i));
    for (std::uint32_t k = 0; k < i % 3; ++k) level.photo_idx.push_back(static_cast<uint16_t>(i));
    level.photo_begin.push_back(static_cast<std::uint32_t>(level.photo_idx.size()));
  }
  const Rigid3d motion = Tilt(70, {-600000, 5, 6}).rotation_and_translation;
  TransformLevel(motion, &level);
  ASSERT_EQ(level.cloud.size(), 500u);
  ASSERT_EQ(level.photo_begin.size(), 501u);
  EXPECT_EQ(level.name, "x");
  for (std::size_t j = 0; j < 500; ++j) {
    const auto i = static_cast<std::size_t>(level.depth[j]);
    const Vec3d at = level.cloud.frame.WorldFromLocal(level.cloud.center[j]);
    EXPECT_LT(Length(at - motion.Apply(input.center[i])), 3e-7);
    EXPECT_NEAR(level.cloud.frame.unit * level.cloud.RadiusOf(j), input.radius[i], 1e-7);
    EXPECT_EQ(level.cloud.ColorOf(j), input.color[i]);
    const double a = 0.01 * static_cast<double>(i);
    EXPECT_LT(Length(level.normal[j].cast<double>() - motion.Rotate({std::cos(a), std::sin(a), 0})),
              1e-6);
    ASSERT_EQ(level.photo_begin[j + 1] - level.photo_begin[j], i % 3);
    for (std::uint32_t k = level.photo_begin[j]; k < level.photo_begin[j + 1]; ++k) {
      EXPECT_EQ(level.photo_idx[k], i);
    }
  }
}

}  // namespace
}  // namespace sherd
