#include "app/project/view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "metaball/error.h"
#include "reconstruction/photographs.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;

void ExpectNear(const Vec3d& a, const Vec3d& b, double tolerance = 1e-9) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

std::string MessageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

ViewContext BoxContext() {
  ViewContext context;
  context.bounds = {{-1, -2, -0.5}, {3, 2, 1.5}};
  return context;
}

// Where the subject's outermost points fall, as shares of the half picture; 1 is the border.
double Reach(const Camera& camera, const std::vector<Vec3d>& points) {
  double reach = 0;
  for (const Vec3d& p : points) {
    double x = 0, y = 0;
    EXPECT_TRUE(camera.Project(p, &x, &y));
    reach = std::max(
        {reach, std::abs(x / camera.width - 0.5) * 2, std::abs(y / camera.height - 0.5) * 2});
  }
  return reach;
}

std::vector<Vec3d> Corners(const Box3d& b) {
  std::vector<Vec3d> corners;
  for (const double x : {b.min.x, b.max.x}) {
    for (const double y : {b.min.y, b.max.y}) {
      for (const double z : {b.min.z, b.max.z}) corners.push_back({x, y, z});
    }
  }
  return corners;
}

TEST(View, AxesAreRightHandedForAnyUp) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200; ++i) {
    const Vec3d up{normal(random), normal(random), normal(random)};
    const std::optional<Vec3d> front =
        i % 2 ? std::optional<Vec3d>({normal(random), normal(random), normal(random)})
              : std::nullopt;
    const PresetAxes axes = AxesFor(up, front);
    ExpectNear(Cross(axes.east, axes.north), axes.up);
    ExpectNear(axes.up, Normalized(up));
    EXPECT_NEAR(Length(axes.north), 1, 1e-12);
    if (front) {
      EXPECT_GE(Dot(axes.north, *front), 0);
    }
  }
}

TEST(View, NorthIsWhatPeopleExpect) {
  ExpectNear(AxesFor(std::nullopt, std::nullopt).north, {0, 1, 0});
  ExpectNear(AxesFor(Vec3d{0, -1, 0}, std::nullopt).north, {0, 0, 1});  // COLMAP's first camera
  ExpectNear(AxesFor(Vec3d{0, 1, 0}, std::nullopt).north, {0, 0, -1});
  ExpectNear(AxesFor(Vec3d{0, 0, -1}, std::nullopt).up, {0, 0, -1});
  // A front along `up` says nothing.
  ExpectNear(AxesFor(Vec3d{0, 0, 1}, Vec3d{0, 0, 5}).north, {0, 1, 0});
}

TEST(View, PresetsLookAlongTheirAxes) {
  struct Case {
    const char* name;
    Vec3d forward, up_in_picture;
  };
  const double s = 1 / std::sqrt(3.0);
  const Case cases[] = {
      {"front", {0, 1, 0}, {0, 0, 1}},
      {"back", {0, -1, 0}, {0, 0, 1}},
      {"left", {1, 0, 0}, {0, 0, 1}},
      {"right", {-1, 0, 0}, {0, 0, 1}},
      {"top", {0, 0, -1}, {0, 1, 0}},
      {"bottom", {0, 0, 1}, {0, 1, 0}},
      {"iso", {-s, s, -s}, Normalized(Vec3d{-1, 1, 2})},
  };
  for (const Case& c : cases) {
    ViewRequest request;
    request.preset = ParseViewPreset(c.name);
    const Camera camera = MakeCamera(BoxContext(), request, 320, 240);
    SCOPED_TRACE(c.name);
    ExpectNear(camera.forward, c.forward);
    ExpectNear(camera.down, -c.up_in_picture);
    EXPECT_LT(Dot(camera.eye - BoxContext().bounds.Center(), camera.forward), 0);
  }
  EXPECT_THAT(MessageOf([] { ParseViewPreset("upside-down"); }), HasSubstr("front, back"));
}

TEST(View, PresetsShowTheWholeBoxAndFillThePicture) {
  for (const std::string& name : ViewPresetNames()) {
    for (const bool orthographic : {false, true}) {
      for (const auto& [w, h] : {std::pair{400, 300}, {300, 900}, {1000, 100}}) {
        ViewRequest request;
        request.preset = ParseViewPreset(name);
        request.orthographic = orthographic;
        const Camera camera = MakeCamera(BoxContext(), request, w, h);
        const double reach = Reach(camera, Corners(BoxContext().bounds));
        EXPECT_LE(reach, 0.9 + 1e-9) << name << " " << w << "x" << h;
        EXPECT_GT(reach, 0.89) << name << " " << w << "x" << h;
      }
    }
  }
}

TEST(View, SamplesFitCloserThanTheBoxAndIgnoreAStray) {
  // A ball does not reach its box's corners.
  ViewContext context;
  context.bounds = {{-1, -1, -1}, {1, 1, 1}};
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 4000; ++i) {
    context.points.push_back(Normalized(Vec3d{normal(random), normal(random), normal(random)}));
  }
  ViewRequest request;
  const Camera by_points = MakeCamera(context, request, 400, 300);
  EXPECT_GT(Reach(by_points, context.points), 0.85);
  EXPECT_LT(Reach(by_points, context.points), 0.95);
  const double distance = Length(by_points.eye);
  context.points.push_back({5, 5, 5});
  EXPECT_NEAR(Length(MakeCamera(context, request, 400, 300).eye), distance, 0.02 * distance);
  context.points.clear();
  EXPECT_GT(Length(MakeCamera(context, request, 400, 300).eye), 1.2 * distance);
}

TEST(View, OnePointIsSeenFromADistance) {
  ViewContext context;
  context.bounds = {{7, 8, 9}, {7, 8, 9}};
  for (const bool orthographic : {false, true}) {
    for (const bool sampled : {false, true}) {
      if (sampled) context.points = {{7, 8, 9}};
      ViewRequest request;
      request.orthographic = orthographic;
      const Camera camera = MakeCamera(context, request, 64, 48);
      double x = 0, y = 0;
      ASSERT_TRUE(camera.Project({7, 8, 9}, &x, &y));
      EXPECT_NEAR(x, 32, 1e-9);
      EXPECT_NEAR(y, 24, 1e-9);
      EXPECT_GT(camera.fx, 0);
      EXPECT_TRUE(std::isfinite(camera.fx));
    }
  }
}

TEST(View, ExplicitCamera) {
  ViewRequest request;
  request.eye = Vec3d{0, -5, 0};
  request.look_at = Vec3d{0, 0, 0};
  request.fov_x_deg = 90;
  Camera camera = MakeCamera(BoxContext(), request, 200, 100);
  ExpectNear(camera.forward, {0, 1, 0});
  EXPECT_NEAR(camera.fx, 100, 1e-9);
  // Without a point to look at: the middle of the points.
  request.look_at.reset();
  camera = MakeCamera(BoxContext(), request, 200, 100);
  ExpectNear(camera.forward, Normalized(Vec3d{1, 5, 0.5}));
  request.fov_x_deg.reset();
  request.ortho_width = 4;
  camera = MakeCamera(BoxContext(), request, 200, 100);
  EXPECT_EQ(camera.projection, Projection::kOrthographic);
  EXPECT_NEAR(camera.fx, 50, 1e-9);
  // `up` of the request goes before that of the project.
  ViewContext context = BoxContext();
  context.up = Vec3d{0, 0, 1};
  request.up = Vec3d{1, 0, 0};
  ExpectNear(MakeCamera(context, request, 10, 10).down.cast<double>(),
             -Normalized(Vec3d{1, 0, 0} - camera.forward * camera.forward.x));
}

TEST(View, PhotographStretchedOrWhole) {
  const Survey survey = testing::WavySurvey(100);
  ViewContext context = BoxContext();
  context.survey = &survey;
  ViewRequest request;
  request.photo = "photo_2.png";
  const Camera truth = testing::WavyCamera(1);
  // Scaled to the size, each axis by itself.
  Camera camera = MakeCamera(context, request, 320, 120);
  ExpectNear(camera.eye, truth.eye);
  ExpectNear(camera.right, truth.right);
  EXPECT_NEAR(camera.fx, 2 * truth.fx, 1e-9);
  EXPECT_NEAR(camera.fy, truth.fy, 1e-9);
  // Whole: a square pixel stays square, and the picture's corners are inside.
  request.keep_photo_shape = true;
  camera = MakeCamera(context, request, 500, 120);
  EXPECT_NEAR(camera.fx, camera.fy, 1e-9);
  EXPECT_NEAR(camera.fy, truth.fy, 1e-9);
  EXPECT_NEAR(camera.cx, 250, 1e-9);
  EXPECT_NEAR(SubjectAspect(context, request), 4.0 / 3, 1e-12);

  context.survey = nullptr;
  EXPECT_THROW(MakeCamera(context, request, 10, 10), InputError);
}

TEST(View, PhotographsAreFoundByTheEndOfTheirNames) {
  Survey survey = testing::WavySurvey(4);
  survey.photographs[1].name = "late/photo_11.png";
  EXPECT_EQ(FindPhotograph(survey, "photo_1.png"), 0u);
  EXPECT_EQ(FindPhotograph(survey, "photo_1"), 0u);
  EXPECT_EQ(FindPhotograph(survey, "late/photo_4.png"), 3u);
  EXPECT_EQ(FindPhotograph(survey, "photo_4.png"), 3u);
  EXPECT_EQ(FindPhotograph(survey, "PHOTO_3.PNG"), 2u);
  EXPECT_EQ(FindPhotograph(survey, "_11"), 1u);
  const std::string none = MessageOf([&] { FindPhotograph(survey, "photo_5.png"); });
  EXPECT_THAT(none, HasSubstr("no photograph is called \"photo_5.png\""));
  EXPECT_THAT(none, HasSubstr("photo_3.png"));
  EXPECT_THAT(MessageOf([&] { FindPhotograph(survey, ".png"); }), HasSubstr("4 photographs"));
  EXPECT_THAT(MessageOf([&] { FindPhotograph(survey, ""); }), HasSubstr("no photograph"));
}

TEST(View, FrontIsWhereMostPhotographsLook) {
  // All round: no front.
  EXPECT_FALSE(EstimateFront(testing::WavyPhotographs(), Vec3d{0, 1, 0}.cast<double>()) &&
               EstimateFront({}, Vec3d{0, 0, 1}));
  std::vector<Photograph> facade(5);  // identity poses look along +z
  const std::optional<Vec3d> front = EstimateFront(facade, Vec3d{0, -1, 0});
  ASSERT_TRUE(front);
  ExpectNear(*front, {0, 0, 1});
  // A survey that is oriented to the world keeps its north.
  EXPECT_FALSE(EstimateFront(testing::WavyPhotographs(), Vec3d{0, 0, 1}));
  EXPECT_FALSE(EstimateFront(facade, std::nullopt));
  // All round about the up axis.
  std::vector<Photograph> ring;
  for (int i = 0; i < 8; ++i) {
    const double half = i * std::numbers::pi / 8;
    Photograph photograph;
    photograph.cam_from_world = {std::cos(half), 0, std::sin(half), 0, {}};
    ring.push_back(photograph);
  }
  EXPECT_FALSE(EstimateFront(ring, Vec3d{0, -1, 0}));
}

TEST(View, SampleTakesEvenlyFromInsideTheBox) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 1000; ++i) points.push_back({i * 1e-3, 0, 0});
  points.push_back({50, 0, 0});
  const Box3d box{{0, -1, -1}, {1, 1, 1}};
  const std::vector<Vec3d> sample = SamplePoints(points, box, 100);
  ASSERT_EQ(sample.size(), 100u);
  for (std::size_t i = 1; i < sample.size(); ++i) {
    EXPECT_NEAR(sample[i].x - sample[i - 1].x, 0.01, 1e-9);
  }
  EXPECT_EQ(SamplePoints(points, box, 5000).size(), 1000u);
  EXPECT_TRUE(SamplePoints({}, box).empty());
}

TEST(View, Captions) {
  ViewRequest request;
  EXPECT_EQ(DescribeView(request), "iso view, perspective");
  request.orthographic = true;
  request.preset = ViewPreset::kTop;
  EXPECT_EQ(DescribeView(request), "top view, orthographic");
  request.eye = Vec3d{1, 2.5, -3};
  EXPECT_EQ(DescribeView(request), "from (1, 2.5, -3), orthographic");
  request.photo = "a.jpg";
  EXPECT_EQ(DescribeView(request), "photograph a.jpg");
}

}  // namespace
}  // namespace sherd
