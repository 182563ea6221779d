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
  for (const ModelCase& c : Cases()) {
    const std::vector<double>& p = c.parameters;
    std::vector<double> distortion;
    if (c.model == CameraModelId::kOpenCv || c.model == CameraModelId::kOpenCvFisheye) {
      distortion.assign(p.begin() + 4, p.begin() + 8);
    } else if (c.model == CameraModelId::kFullOpenCv) {
      distortion.assign(p.begin() + 4, p.end());
    } else {
      continue;
    }
    const cv::Matx33d k(p[0], 0, p[2], 0, p[1], p[3], 0, 0, 1);
    std::vector<cv::Point2d> expected;
    const cv::Vec3d zero(0, 0, 0);
    if (c.model == CameraModelId::kOpenCvFisheye) {
      cv::fisheye::projectPoints(points, expected, zero, zero, k, distortion);
    } else {
      cv::projectPoints(points, zero, zero, k, distortion, expected);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto q = CameraOf(c).Project({points[i].x, points[i].y, points[i].z});
      ASSERT_TRUE(q);
      EXPECT_NEAR(q->first, expected[i].x, 1e-8);
      EXPECT_NEAR(q->second, expected[i].y, 1e-8);
    }
  }
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
