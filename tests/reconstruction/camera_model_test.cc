// Projections against formulas written another way (angles and polynomials of the radius instead of
// COLMAP's distortion offsets), and OpenCV's where it has the model.
#include "reconstruction/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "reconstruction/camera_projector.h"

namespace sherd {
namespace {

using Point = std::pair<double, double>;

struct ModelCase {
  CameraModelId model;
  std::vector<double> parameters;
  // Where the ray at `angle` from the axis, in the direction `phi`, meets the picture.
  std::function<Point(const std::vector<double>&, double angle, double phi)> reference;
};

Point Radial(double fx, double fy, double cx, double cy, double r, double phi) {
  return {fx * r * std::cos(phi) + cx, fy * r * std::sin(phi) + cy};
}

// r (1 + sum k_i r^(2 i + 2))
double Polynomial(double r, std::initializer_list<double> k) {
  double power = r * r, sum = 1;
  for (const double c : k) {
    sum += c * power;
    power *= r * r;
  }
  return r * sum;
}

// Brown's tangential terms for a point (x, y): p1 and p2 as OpenCV names them.
Point Tangential(double x, double y, double p1, double p2) {
  const double r2 = x * x + y * y;
  return {2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

std::vector<ModelCase> Cases() {
  using V = std::vector<double>;
  const double f = 500, fx = 510, fy = 490, cx = 320.5, cy = 241;
  std::vector<ModelCase> cases;
  const auto add = [&](CameraModelId model, V parameters, auto reference) {
    cases.push_back({model, std::move(parameters), reference});
  };
  using enum CameraModelId;
  add(kSimplePinhole, {f, cx, cy}, [](const V& p, double a, double phi) {
    return Radial(p[0], p[0], p[1], p[2], std::tan(a), phi);
  });
  add(kPinhole, {fx, fy, cx, cy}, [](const V& p, double a, double phi) {
    return Radial(p[0], p[1], p[2], p[3], std::tan(a), phi);
  });
  add(kSimpleRadial, {f, cx, cy, 0.1}, [](const V& p, double a, double phi) {
    return Radial(p[0], p[0], p[1], p[2], Polynomial(std::tan(a), {p[3]}), phi);
  });
  add(kRadial, {f, cx, cy, -0.1, 0.05}, [](const V& p, double a, double phi) {
    return Radial(p[0], p[0], p[1], p[2], Polynomial(std::tan(a), {p[3], p[4]}), phi);
  });
  add(kOpenCv, {fx, fy, cx, cy, -0.1, 0.05, 2e-3, -3e-3}, [](const V& p, double a, double phi) {
    const double r = std::tan(a);
    const Point t = Tangential(r * std::cos(phi), r * std::sin(phi), p[6], p[7]);
    const double d = Polynomial(r, {p[4], p[5]});
    return Point{p[0] * (d * std::cos(phi) + t.first) + p[2],
                 p[1] * (d * std::sin(phi) + t.second) + p[3]};
  });
  add(kOpenCvFisheye, {fx, fy, cx, cy, 0.02, -0.01, 0.005, 0.001},
      [](const V& p, double a, double phi) {
        return Radial(p[0], p[1], p[2], p[3], Polynomial(a, {p[4], p[5], p[6], p[7]}), phi);
      });
  add(kFullOpenCv, {fx, fy, cx, cy, 0.1, 0.02, 1e-3, 2e-3, 0.003, 0.05, 0.01, 0.002},
      [](const V& p, double a, double phi) {
        const double r = std::tan(a);
        const Point t = Tangential(r * std::cos(phi), r * std::sin(phi), p[6], p[7]);
        const double d =
            Polynomial(r, {p[4], p[5], p[8]}) / (Polynomial(r, {p[9], p[10], p[11]}) / r);
        return Point{p[0] * (d * std::cos(phi) + t.first) + p[2],
                     p[1] * (d * std::sin(phi) + t.second) + p[3]};
      });
  add(kFov, {fx, fy, cx, cy, 0.9}, [](const V& p, double a, double phi) {
    return Radial(p[0], p[1], p[2], p[3], std::atan(2 * std::tan(a) * std::tan(p[4] / 2)) / p[4],
                  phi);
  });
  add(kSimpleRadialFisheye, {f, cx, cy, -0.03}, [](const V& p, double a, double phi) {
    return Radial(p[0], p[0], p[1], p[2], Polynomial(a, {p[3]}), phi);
  });
  add(kRadialFisheye, {f, cx, cy, -0.03, 0.01}, [](const V& p, double a, double phi) {
    return Radial(p[0], p[0], p[1], p[2], Polynomial(a, {p[3], p[4]}), phi);
  });
  add(kThinPrismFisheye, {fx, fy, cx, cy, 0.02, -0.01, 1e-3, 2e-3, 0.004, 0.001, 5e-4, -4e-4},
      [](const V& p, double a, double phi) {
        const Point t = Tangential(a * std::cos(phi), a * std::sin(phi), p[6], p[7]);
        const double d = Polynomial(a, {p[4], p[5], p[8], p[9]});
        return Point{p[0] * (d * std::cos(phi) + t.first + p[10] * a * a) + p[2],
                     p[1] * (d * std::sin(phi) + t.second + p[11] * a * a) + p[3]};
      });
  add(kRadTanThinPrismFisheye,
      {fx, fy, cx, cy, 0.02, -0.01, 0.004, 0.001, -2e-3, 1e-3, 1e-3, 2e-3, 5e-4, -4e-4, 3e-4, 2e-4},
      [](const V& p, double a, double phi) {
        const double d = Polynomial(a, {p[4], p[5], p[6], p[7], p[8], p[9]});
        const double x = d * std::cos(phi), y = d * std::sin(phi), r2 = d * d;
        // Here p0 belongs to x: the roles of Brown's two are exchanged.
        const Point t = Tangential(x, y, p[11], p[10]);
        return Point{p[0] * (x + t.first + p[12] * r2 + p[13] * r2 * r2) + p[2],
                     p[1] * (y + t.second + p[14] * r2 + p[15] * r2 * r2) + p[3]};
      });
  // The division model says where a distorted radius comes from: tan(a) = r / (1 + k r^2).
  const auto division = [](double k, double a) {
    double r = std::tan(a);
    for (int i = 0; i < 200; ++i) r = std::tan(a) * (1 + k * r * r);
    return r;
  };
  add(kSimpleDivision, {f, cx, cy, -0.1}, [division](const V& p, double a, double phi) {
    return Radial(p[0], p[0], p[1], p[2], division(p[3], a), phi);
  });
  add(kDivision, {fx, fy, cx, cy, 0.08}, [division](const V& p, double a, double phi) {
    return Radial(p[0], p[1], p[2], p[3], division(p[4], a), phi);
  });
  add(kSimpleFisheye, {f, cx, cy},
      [](const V& p, double a, double phi) { return Radial(p[0], p[0], p[1], p[2], a, phi); });
  add(kFisheye, {fx, fy, cx, cy},
      [](const V& p, double a, double phi) { return Radial(p[0], p[1], p[2], p[3], a, phi); });
  add(kEucm, {fx, fy, cx, cy, 0.6, 1.1}, [](const V& p, double a, double phi) {
    const double r =
        std::sin(a) /
        (p[4] * std::sqrt(p[5] * std::sin(a) * std::sin(a) + std::cos(a) * std::cos(a)) +
         (1 - p[4]) * std::cos(a));
    return Radial(p[0], p[1], p[2], p[3], r, phi);
  });
  add(kEquirectangular, {2000, 1000}, [](const V& p, double a, double phi) {
    const double x = std::sin(a) * std::cos(phi), y = std::sin(a) * std::sin(phi), z = std::cos(a);
    return Point{p[0] * (0.5 + std::atan2(x, z) / (2 * std::numbers::pi)),
                 p[1] * (0.5 + std::asin(y) / std::numbers::pi)};
  });
  return cases;
}

SurveyCamera CameraOf(const ModelCase& c) {
  SurveyCamera camera;
  camera.model = c.model;
  camera.width = 640;
  camera.height = 480;
  camera.parameters = c.parameters;
  return camera;
}

TEST(CameraModel, EveryModelHasACase) {
  ASSERT_EQ(Cases().size(), 18u);
  for (int id = 0; id < 18; ++id) {
    EXPECT_EQ(static_cast<int>(Cases()[id].model), id);
    EXPECT_EQ(static_cast<int>(Cases()[id].parameters.size()), *NumParameters(id));
    EXPECT_EQ(static_cast<int>(*CameraModelFromName(CameraModelName(id))), id);
  }
  EXPECT_FALSE(CameraModelFromName("pinhole"));
  EXPECT_TRUE(CameraModelName(18).empty());
}

TEST(CameraModel, ProjectsAsTheFormulaSays) {
  for (const ModelCase& c : Cases()) {
    const SurveyCamera camera = CameraOf(c);
    for (double angle = 0.001; angle < 0.75; angle += 0.0437) {
      for (double phi = 0.1; phi < 6.3; phi += 0.7) {
        const Vec3d direction{std::sin(angle) * std::cos(phi), std::sin(angle) * std::sin(phi),
                              std::cos(angle)};
        for (const double distance : {0.3, 40.0}) {
          const auto p = camera.Project(direction * distance);
          ASSERT_TRUE(p) << CameraModelName(static_cast<int>(c.model)) << " " << angle;
          const Point expected = c.reference(c.parameters, angle, phi);
          EXPECT_NEAR(p->first, expected.first, 1e-7)
              << CameraModelName(static_cast<int>(c.model)) << " " << angle << " " << phi;
          EXPECT_NEAR(p->second, expected.second, 1e-7);
        }
      }
    }
  }
}

// What the formula says is seen at (x, y) is found again from there.
TEST(CameraModel, UnprojectsWhatTheFormulaProjects) {
  for (const ModelCase& c : Cases()) {
    const CameraProjector projector(CameraOf(c));
    for (double angle = 0; angle < 0.75; angle += 0.0437) {
      for (double phi = 0.1; phi < 6.3; phi += 0.7) {
        const Vec3d direction{std::sin(angle) * std::cos(phi), std::sin(angle) * std::sin(phi),
                              std::cos(angle)};
        const Point p = c.reference(c.parameters, std::max(angle, 1e-12), phi);
        Vec3d found;
        ASSERT_TRUE(projector.Unproject(p.first, p.second, &found))
            << CameraModelName(static_cast<int>(c.model)) << " " << angle << " " << phi;
        EXPECT_LT(Length(found - direction), 1e-9)
            << CameraModelName(static_cast<int>(c.model)) << " " << angle << " " << phi;
      }
    }
  }
}

// Over the whole picture and far beyond it: either there is no direction, or it is projected back
// to where it was seen.
TEST(CameraModel, UnprojectionIsTheInverseOrNothing) {
  for (const ModelCase& c : Cases()) {
    for (const double sign : {1.0, -1.0}) {
      SurveyCamera camera = CameraOf(c);
      const std::size_t first = c.model == CameraModelId::kEquirectangular ? 99 : 4;
      for (std::size_t i = first; i < camera.parameters.size() && c.model != CameraModelId::kEucm;
           ++i) {
        camera.parameters[i] *= sign;
      }
      const CameraProjector projector(camera);
      int seen = 0;
      for (double x = -3000; x <= 4000; x += 61.7) {
        for (double y = -3000; y <= 4000; y += 67.3) {
          Vec3d direction;
          if (!projector.Unproject(x, y, &direction)) continue;
          ++seen;
          EXPECT_NEAR(Length(direction), 1, 1e-12);
          double bx, by;
          // A direction into the image plane cannot be projected.
          if (direction.z < 1e-9 && !projector.Project(direction, &bx, &by)) continue;
          ASSERT_TRUE(projector.Project(direction * 3.0, &bx, &by))
              << CameraModelName(static_cast<int>(c.model)) << " " << x << " " << y;
          EXPECT_NEAR(bx, x, 1e-6) << CameraModelName(static_cast<int>(c.model));
          EXPECT_NEAR(by, y, 1e-6) << CameraModelName(static_cast<int>(c.model));
        }
      }
      EXPECT_GT(seen, 30) << CameraModelName(static_cast<int>(c.model));
      for (const double bad : {double(NAN), double(INFINITY)}) {
        EXPECT_FALSE(camera.Unproject(bad, 100)) << CameraModelName(static_cast<int>(c.model));
        EXPECT_FALSE(camera.Unproject(100, bad)) << CameraModelName(static_cast<int>(c.model));
      }
    }
  }
}

TEST(CameraModel, WhereNothingIsSeenThereIsNoDirection) {
  SurveyCamera camera;
  camera.width = camera.height = 1000;
  // r (1 - 0.2 r^2) reaches no farther than 0.861 (at r = 1.291).
  camera.model = CameraModelId::kSimpleRadial;
  camera.parameters = {500, 500, 500, -0.2};
  const double farthest = std::sqrt(1 / 0.6) * (1 - 0.2 / 0.6);
  EXPECT_TRUE(camera.Unproject(500 + 500 * farthest * 0.9999, 500));
  EXPECT_FALSE(camera.Unproject(500 + 500 * farthest * 1.0001, 500));
  // The other fold, where the radius comes back: the nearer direction is the one that is seen.
  const auto near = camera.Unproject(500 + 500 * 0.8 * (1 - 0.2 * 0.64), 500);
  ASSERT_TRUE(near);
  EXPECT_NEAR(near->x / near->z, 0.8, 1e-9);
  // Half a turn of fisheye is what a plane camera can look at.
  camera.model = CameraModelId::kSimpleFisheye;
  camera.parameters = {300, 500, 500};
  EXPECT_TRUE(camera.Unproject(500 + 300 * 1.57, 500));
  EXPECT_FALSE(camera.Unproject(500 + 300 * 1.58, 500));
  // Division with k > 0: the picture ends where the two roots meet.
  camera.model = CameraModelId::kSimpleDivision;
  camera.parameters = {500, 500, 500, 0.25};
  EXPECT_TRUE(camera.Unproject(500 + 500 * 1.99, 500));
  EXPECT_FALSE(camera.Unproject(500 + 500 * 2.01, 500));
  // A sphere seen from 2 / 3 of its radius behind its centre has a horizon.
  camera.model = CameraModelId::kEucm;
  camera.parameters = {500, 500, 500, 500, 0.8, 1.0};
  EXPECT_FALSE(camera.Unproject(500 + 500 * 1.5, 500));
  EXPECT_FALSE(camera.Project({1, 0, 0}));
  // FOV: all directions lie within pi / (2 omega).
  camera.model = CameraModelId::kFov;
  camera.parameters = {500, 500, 500, 500, 1.0};
  EXPECT_TRUE(camera.Unproject(500 + 500 * 1.57, 500));
  EXPECT_FALSE(camera.Unproject(500 + 500 * 1.58, 500));
  // A panorama ends at its border.
  camera.model = CameraModelId::kEquirectangular;
  camera.parameters = {2000, 1000};
  EXPECT_TRUE(camera.Unproject(0, 0));
  EXPECT_FALSE(camera.Unproject(-1, 500));
  EXPECT_FALSE(camera.Unproject(100, 1001));
}

// The models OpenCV has, as it takes them; a pixel's place is the same number in both, for the
// offset of half a pixel is in the principal point.
struct OpenCvCamera {
  cv::Matx33d k;
  std::vector<double> distortion;
  bool fisheye = false;
};

std::optional<OpenCvCamera> ForOpenCv(const ModelCase& c) {
  const std::vector<double>& p = c.parameters;
  const auto matrix = [](double fx, double fy, double cx, double cy) {
    return cv::Matx33d(fx, 0, cx, 0, fy, cy, 0, 0, 1);
  };
  const cv::Matx33d one = matrix(p[0], p[0], p[1], p[2]);
  const cv::Matx33d two = p.size() > 3 ? matrix(p[0], p[1], p[2], p[3]) : one;
  using enum CameraModelId;
  switch (c.model) {
    case kSimplePinhole:
      return OpenCvCamera{one, {0, 0, 0, 0}};
    case kPinhole:
      return OpenCvCamera{two, {0, 0, 0, 0}};
    case kSimpleRadial:
      return OpenCvCamera{one, {p[3], 0, 0, 0}};
    case kRadial:
      return OpenCvCamera{one, {p[3], p[4], 0, 0}};
    case kOpenCv:
    case kFullOpenCv:
      return OpenCvCamera{two, {p.begin() + 4, p.end()}};
    case kOpenCvFisheye:
      return OpenCvCamera{two, {p.begin() + 4, p.end()}, true};
    case kSimpleRadialFisheye:
      return OpenCvCamera{one, {p[3], 0, 0, 0}, true};
    case kRadialFisheye:
      return OpenCvCamera{one, {p[3], p[4], 0, 0}, true};
    case kSimpleFisheye:
      return OpenCvCamera{one, {0, 0, 0, 0}, true};
    case kFisheye:
      return OpenCvCamera{two, {0, 0, 0, 0}, true};
    default:
      return std::nullopt;
  }
}

TEST(CameraModel, UnprojectsAsOpenCv) {
  std::vector<cv::Point2d> pixels, expected;
  for (double x = 20; x < 640; x += 60) {
    for (double y = 20; y < 480; y += 55) pixels.emplace_back(x, y);
  }
  for (const ModelCase& c : Cases()) {
    const std::optional<OpenCvCamera> camera = ForOpenCv(c);
    if (!camera) continue;
    const cv::TermCriteria precise(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-12);
    if (camera->fisheye) {
      // Debian's 4.6 ends its own iteration at 1e-8.
      cv::fisheye::undistortPoints(pixels, expected, camera->k, camera->distortion);
    } else {
      cv::undistortPoints(pixels, expected, camera->k, camera->distortion, cv::noArray(),
                          cv::noArray(), precise);
    }
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const auto d = CameraOf(c).Unproject(pixels[i].x, pixels[i].y);
      ASSERT_TRUE(d);
      EXPECT_NEAR(d->x / d->z, expected[i].x, 1e-7);
      EXPECT_NEAR(d->y / d->z, expected[i].y, 1e-7);
    }
  }
}

// Tangential and prism terms fold as well, each direction at another radius.
TEST(CameraModel, TangentialTermsDoNotFoldEither) {
  SurveyCamera camera;
  camera.model = CameraModelId::kOpenCv;
  camera.width = camera.height = 1000;
  camera.parameters = {500, 500, 500, 500, 0, 0, 0, 0.05};
  // Along -x: x (1 + 3 p2 x) turns at x = -1 / (6 p2).
  const CameraProjector projector(camera);
  EXPECT_LE(projector.radius_limit(), 1 / 0.3 * 1.000001);
  EXPECT_GT(projector.radius_limit(), 1 / 0.3 * 0.9);
  EXPECT_FALSE(camera.Project({-1 / 0.3 * 1.01, 0, 1}));
}

// COLMAP's series for a small angle, and its neighbour, the exact formula.
TEST(CameraModel, FovOfASmallAngle) {
  SurveyCamera camera;
  camera.model = CameraModelId::kFov;
  camera.width = camera.height = 1000;
  for (const double omega : {1e-4, 0.0099, 0.0101}) {
    camera.parameters = {500, 500, 500, 500, omega};
    for (const double r : {0.005, 0.02, 0.5, 1.0}) {
      const auto p = camera.Project({r, 0, 1});
      ASSERT_TRUE(p);
      const double exact = std::atan(2 * r * std::tan(omega / 2)) / omega;
      EXPECT_NEAR(p->first, 500 + 500 * exact, 500 * r * 1e-4);
      const auto d = camera.Unproject(p->first, p->second);
      ASSERT_TRUE(d);
      EXPECT_NEAR(d->x / d->z, r, 1e-9);
    }
  }
}

TEST(CameraModel, TheAxisMeetsThePrincipalPoint) {
  for (const ModelCase& c : Cases()) {
    const auto p = CameraOf(c).Project({0, 0, 5});
    ASSERT_TRUE(p);
    if (c.model == CameraModelId::kEquirectangular) {
      EXPECT_NEAR(p->first, 1000, 1e-9);
      EXPECT_NEAR(p->second, 500, 1e-9);
    } else {
      EXPECT_NEAR(p->first, 320.5, 1e-9);
      EXPECT_NEAR(p->second, 241, 1e-9);
    }
  }
}

TEST(CameraModel, NothingBehindTheCameraIsSeenButByAPanorama) {
  for (const ModelCase& c : Cases()) {
    const auto p = CameraOf(c).Project({0.1, 0.2, -5});
    if (c.model == CameraModelId::kEquirectangular) {
      EXPECT_TRUE(p);
    } else if (c.model == CameraModelId::kSimpleDivision) {
      // A negative coefficient reaches behind the camera, far outside the picture.
      EXPECT_TRUE(!p || std::abs(p->first) > 5000 || std::abs(p->second) > 5000);
    } else {
      EXPECT_FALSE(p) << CameraModelName(static_cast<int>(c.model));
    }
    EXPECT_FALSE(CameraOf(c).Project({0, 0, 0}));
    EXPECT_FALSE(CameraOf(c).Project({NAN, 0, 1}));
  }
}

TEST(CameraModel, AgreesWithOpenCv) {
  std::vector<cv::Point3d> points;
  for (double x = -0.8; x <= 0.8; x += 0.2) {
    for (double y = -0.7; y <= 0.7; y += 0.2) points.emplace_back(x * 2, y * 2, 2.0);
  }
  int models = 0;
  for (const ModelCase& c : Cases()) {
    const std::optional<OpenCvCamera> camera = ForOpenCv(c);
    if (!camera) continue;
    ++models;
    std::vector<cv::Point2d> expected;
    const cv::Vec3d zero(0, 0, 0);
    if (camera->fisheye) {
      cv::fisheye::projectPoints(points, expected, zero, zero, camera->k, camera->distortion);
    } else {
      cv::projectPoints(points, zero, zero, camera->k, camera->distortion, expected);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto q = CameraOf(c).Project({points[i].x, points[i].y, points[i].z});
      ASSERT_TRUE(q);
      EXPECT_NEAR(q->first, expected[i].x, 1e-8);
      EXPECT_NEAR(q->second, expected[i].y, 1e-8);
    }
  }
  EXPECT_EQ(models, 11);
}

// r (1 - 0.2 r^2) turns back at r = 1.291: what lies beyond would be folded into the picture.
TEST(CameraModel, NothingIsFoldedBackIntoThePicture) {
  SurveyCamera camera;
  camera.model = CameraModelId::kSimpleRadial;
  camera.width = 1000;
  camera.height = 1000;
  camera.parameters = {500, 500, 500, -0.2};
  const double turn = std::sqrt(1 / 0.6);
  EXPECT_NEAR(CameraProjector(camera).radius_limit(), turn, 1e-6);
  EXPECT_TRUE(camera.Project({turn * 0.999, 0, 1}));
  EXPECT_FALSE(camera.Project({turn * 1.001, 0, 1}));
  EXPECT_FALSE(camera.Project({2.2, 0, 1})) << "would land at x = 535";
  camera.parameters[3] = 0.2;
  EXPECT_TRUE(std::isinf(CameraProjector(camera).radius_limit()));
}

TEST(CameraModel, PinholeOfEveryModel) {
  for (const ModelCase& c : Cases()) {
    double fx, fy, cx, cy;
    CameraOf(c).Pinhole(&fx, &fy, &cx, &cy);
    if (c.model == CameraModelId::kEquirectangular) {
      EXPECT_EQ(fx, 320);
      EXPECT_EQ(cx, 320);
      EXPECT_EQ(cy, 240);
      continue;
    }
    EXPECT_EQ(fx, c.parameters[0]);
    EXPECT_EQ(fy, c.parameters[0] == 510 ? 490 : 500);
    EXPECT_EQ(cx, 320.5);
    EXPECT_EQ(cy, 241);
  }
}

}  // namespace
}  // namespace sherd
