// The projection of COLMAP's camera models (colmap/src/colmap/sensor/models.h), on the CPU and on
// the GPU. Image coordinates: the upper-left corner of the image is (0, 0), the centre of the first
// pixel (0.5, 0.5).
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// The numbers are those of cameras.bin.
enum class CameraModelId : int {
  kSimplePinhole = 0,
  kPinhole = 1,
  kSimpleRadial = 2,
  kRadial = 3,
  kOpenCv = 4,
  kOpenCvFisheye = 5,
  kFullOpenCv = 6,
  kFov = 7,
  kSimpleRadialFisheye = 8,
  kRadialFisheye = 9,
  kThinPrismFisheye = 10,
  kRadTanThinPrismFisheye = 11,
  kSimpleDivision = 12,
  kDivision = 13,
  kSimpleFisheye = 14,
  kFisheye = 15,
  kEucm = 16,
  kEquirectangular = 17,
};

// (u, v) is an angle times a direction.
SHERD_HD bool IsFisheye(CameraModelId model) {
  switch (model) {
    case CameraModelId::kOpenCvFisheye:
    case CameraModelId::kSimpleRadialFisheye:
    case CameraModelId::kRadialFisheye:
    case CameraModelId::kThinPrismFisheye:
    case CameraModelId::kRadTanThinPrismFisheye:
    case CameraModelId::kSimpleFisheye:
    case CameraModelId::kFisheye:
      return true;
    default:
      return false;
  }
}

SHERD_HD double ValueOf(double a) { return a; }

// Of the field-of-view model. T: a number, or one that carries derivatives (lens_distortion.cc),
// with ValueOf.
template <class T>
SHERD_HD T FovFactor(double omega, const T& r2) {
  using std::atan;
  using std::sqrt;
  const double omega2 = omega * omega;
  if (omega2 < 1e-4) {
    // COLMAP's series has the opposite sign of the function's own; kept, because the models it
    // writes were fitted with it. The two differ by less than 1e-4 of the radius up to 60 degrees.
    return r2 * (omega2 / 3) - omega2 / 12 + 1.0;
  }
  const double t = std::tan(omega / 2);
  if (ValueOf(r2) < 1e-4) return (r2 * (4 * t * t) - 3.0) * (-2 * t / (3 * omega));
  const T r = sqrt(r2);
  return atan(r * (2 * t)) / (r * omega);
}

// The distortion with the coefficients k, those that stand after focal lengths and principal point
// in COLMAP's order, twelve with zeros: of tangents for the pinhole family (u = X / Z), of angles
// for the fisheye family ((u, v) as long as the angle from the axis in radians). False where a
// rational model has no value.
template <class T>
SHERD_HD bool Distorted(CameraModelId model, const double* k, const T& u, const T& v, T* x, T* y) {
  const T r2 = u * u + v * v;
  T factor = 1.0;
  double p1 = 0, p2 = 0;  // Brown's tangential terms as OpenCV names them
  switch (model) {
    case CameraModelId::kSimpleRadial:
    case CameraModelId::kSimpleRadialFisheye:
      factor = r2 * k[0] + 1.0;
      break;
    case CameraModelId::kRadial:
    case CameraModelId::kRadialFisheye:
      factor = r2 * (r2 * k[1] + k[0]) + 1.0;
      break;
    case CameraModelId::kOpenCv:
      factor = r2 * (r2 * k[1] + k[0]) + 1.0;
      p1 = k[2];
      p2 = k[3];
      break;
    case CameraModelId::kOpenCvFisheye:
      factor = r2 * (r2 * (r2 * (r2 * k[3] + k[2]) + k[1]) + k[0]) + 1.0;
      break;
    case CameraModelId::kFullOpenCv: {
      const T denominator = r2 * (r2 * (r2 * k[7] + k[6]) + k[5]) + 1.0;
      if (!(ValueOf(denominator) > std::numeric_limits<double>::epsilon())) return false;
      factor = (r2 * (r2 * (r2 * k[4] + k[1]) + k[0]) + 1.0) / denominator;
      p1 = k[2];
      p2 = k[3];
      break;
    }
    case CameraModelId::kFov:
      factor = FovFactor(k[0], r2);
      break;
    case CameraModelId::kThinPrismFisheye:
      factor = r2 * (r2 * (r2 * (r2 * k[5] + k[4]) + k[1]) + k[0]) + 1.0;
      p1 = k[2];
      p2 = k[3];
      break;
    case CameraModelId::kRadTanThinPrismFisheye: {
      factor =
          r2 * (r2 * (r2 * (r2 * (r2 * (r2 * k[5] + k[4]) + k[3]) + k[2]) + k[1]) + k[0]) + 1.0;
      // Tangential and thin prism terms act on what the radial ones have moved.
      const T a = u * factor, b = v * factor;
      const T q2 = a * a + b * b;
      const double p0 = k[6];
      p1 = k[7];
      *x = a + a * b * (2 * p1) + (q2 + a * a * 2.0) * p0 + q2 * (q2 * k[9] + k[8]);
      *y = b + a * b * (2 * p0) + (q2 + b * b * 2.0) * p1 + q2 * (q2 * k[11] + k[10]);
      return true;
    }
    default:
      break;
  }
  *x = u * factor;
  *y = v * factor;
  if (p1 != 0 || p2 != 0) {
    *x = *x + u * v * (2 * p1) + (r2 + u * u * 2.0) * p2;
    *y = *y + u * v * (2 * p2) + (r2 + v * v * 2.0) * p1;
  }
  if (model == CameraModelId::kThinPrismFisheye) {
    *x = *x + r2 * k[6];
    *y = *y + r2 * k[7];
  }
  return true;
}

// A lens as its parameters say, limited to where its distortion is one-to-one.
struct Lens {
  CameraModelId model = CameraModelId::kPinhole;
  // Pixels; of a panorama fx and fy are the picture's sides.
  double fx = 1, fy = 1, cx = 0, cy = 0;
  double k[12] = {};
  bool distorts = false;  // by Distorted, whose coefficients are not all 0
  double radius_limit = std::numeric_limits<double>::infinity();  // of (u, v) that are projected

  // (u, v) distorted; false beyond the limit and where a rational model has no value.
  SHERD_HD bool Distort(double u, double v, double* x, double* y) const {
    if (!(u * u + v * v <= radius_limit * radius_limit)) return false;
    if (distorts) return Distorted(model, k, u, v, x, y);
    *x = u;
    *y = v;
    return true;
  }

  // Image coordinates of a point in the camera's frame; false where the model has no image of it
  // (behind the camera, outside the model's domain).
  SHERD_HD bool Project(const Vec3d& p, double* x, double* y) const {
    constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
    double u, v;
    if (model == CameraModelId::kEquirectangular) {
      constexpr double kPi = std::numbers::pi;
      const double horizontal = std::hypot(p.x, p.z);
      if (!(horizontal + std::abs(p.y) > kEpsilon)) return false;
      *x = (std::atan2(p.x, p.z) / (2 * kPi) + 0.5) * fx;
      *y = (0.5 - std::atan2(-p.y, horizontal) / kPi) * fy;
      return true;
    }
    if (model == CameraModelId::kSimpleDivision || model == CameraModelId::kDivision) {
      const double discriminant = p.z * p.z - 4 * k[0] * (p.x * p.x + p.y * p.y);
      if (!(discriminant >= 0)) return false;
      const double w = p.z + std::sqrt(discriminant);
      if (!(w > kEpsilon)) return false;
      u = 2 * p.x / w;
      v = 2 * p.y / w;
    } else if (model == CameraModelId::kEucm) {
      if (!(p.z > kEpsilon)) return false;
      const double alpha = k[0];
      const double rho2 = k[1] * (p.x * p.x + p.y * p.y) + p.z * p.z;
      if (!(rho2 >= 0)) return false;
      const double rho = std::sqrt(rho2);
      const double w = alpha * rho + (1 - alpha) * p.z;
      // The second condition: the radius still grows with the angle (always for alpha <= 1).
      if (!(w > kEpsilon) || !(alpha * p.z + (1 - alpha) * rho > 0)) return false;
      u = p.x / w;
      v = p.y / w;
    } else {
      if (!(p.z > kEpsilon)) return false;
      u = p.x / p.z;
      v = p.y / p.z;
      if (IsFisheye(model)) {
        const double r = std::sqrt(u * u + v * v);
        const double factor = r > kEpsilon ? std::atan(r) / r : 1.0;
        u *= factor;
        v *= factor;
      }
      if (!Distort(u, v, &u, &v)) return false;
    }
    *x = fx * u + cx;
    *y = fy * v + cy;
    return std::isfinite(*x) && std::isfinite(*y);
  }
};

}  // namespace sherd
