#include "reconstruction/camera_projector.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sherd {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// The distortion that depends on the radius alone, as numerator and denominator in r^2:
// r_distorted = r * (1 + n1 r^2 + ...) / (1 + d1 r^2 + ...).
struct RadialTerms {
  double numerator[6] = {};
  double denominator[3] = {};
  bool fisheye = false;
};

RadialTerms RadialTermsOf(CameraModelId model, const std::array<double, 12>& k) {
  RadialTerms terms;
  switch (model) {
    case CameraModelId::kSimpleRadialFisheye:
      terms.fisheye = true;
      [[fallthrough]];
    case CameraModelId::kSimpleRadial:
      terms.numerator[0] = k[0];
      break;
    case CameraModelId::kRadialFisheye:
      terms.fisheye = true;
      [[fallthrough]];
    case CameraModelId::kRadial:
    case CameraModelId::kOpenCv:
      terms.numerator[0] = k[0];
      terms.numerator[1] = k[1];
      break;
    case CameraModelId::kOpenCvFisheye:
      terms.fisheye = true;
      std::copy_n(k.begin(), 4, terms.numerator);
      break;
    case CameraModelId::kThinPrismFisheye:
      terms.fisheye = true;
      terms.numerator[0] = k[0];
      terms.numerator[1] = k[1];
      terms.numerator[2] = k[4];
      terms.numerator[3] = k[5];
      break;
    case CameraModelId::kRadTanThinPrismFisheye:
      terms.fisheye = true;
      std::copy_n(k.begin(), 6, terms.numerator);
      break;
    case CameraModelId::kFullOpenCv:
      terms.numerator[0] = k[0];
      terms.numerator[1] = k[1];
      terms.numerator[2] = k[4];
      std::copy_n(k.begin() + 5, 3, terms.denominator);
      break;
    default:
      break;
  }
  return terms;
}

// Whether the distorted radius still grows at r.
bool Grows(const RadialTerms& terms, double r) {
  const double t = r * r;
  double n = 1, dn = 0, d = 1, dd = 0, power = 1;  // dn, dd: derivatives by t
  for (int i = 0; i < 6; ++i) {
    dn += (i + 1) * terms.numerator[i] * power;
    if (i < 3) dd += (i + 1) * terms.denominator[i] * power;
    power *= t;
    n += terms.numerator[i] * power;
    if (i < 3) d += terms.denominator[i] * power;
  }
  return d > 0 && n * d + 2 * t * (dn * d - n * dd) > 0;
}

double RadiusLimit(const RadialTerms& terms) {
  const bool distorts = std::any_of(std::begin(terms.numerator), std::end(terms.numerator),
                                    [](double v) { return v != 0; }) ||
                        std::any_of(std::begin(terms.denominator), std::end(terms.denominator),
                                    [](double v) { return v != 0; });
  if (!distorts) return std::numeric_limits<double>::infinity();
  constexpr int kSteps = 512;
  const auto radius = [&](double step) {
    const double angle = step / kSteps * (std::numbers::pi / 2) * 0.9999;
    return terms.fisheye ? angle : std::tan(angle);
  };
  for (int i = 1; i <= kSteps; ++i) {
    if (Grows(terms, radius(i))) continue;
    double lo = i - 1, hi = i;
    for (int j = 0; j < 50; ++j)
      (Grows(terms, radius(0.5 * (lo + hi))) ? lo : hi) = 0.5 * (lo + hi);
    return radius(lo);
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

CameraProjector::CameraProjector(const SurveyCamera& camera) : model_(camera.model) {
  std::size_t first = 4;
  if (model_ == CameraModelId::kEquirectangular) {
    fx_ = camera.parameters[0];
    fy_ = camera.parameters[1];
    first = 2;
  } else {
    camera.Pinhole(&fx_, &fy_, &cx_, &cy_);
    if (model_ == CameraModelId::kSimplePinhole || model_ == CameraModelId::kSimpleRadial ||
        model_ == CameraModelId::kRadial || model_ == CameraModelId::kSimpleRadialFisheye ||
        model_ == CameraModelId::kRadialFisheye || model_ == CameraModelId::kSimpleDivision ||
        model_ == CameraModelId::kSimpleFisheye) {
      first = 3;
    }
  }
  for (std::size_t i = first; i < camera.parameters.size() && i - first < k_.size(); ++i) {
    k_[i - first] = camera.parameters[i];
  }
  radius_limit_ = RadiusLimit(RadialTermsOf(model_, k_));
}

bool CameraProjector::Distort(double* u_inout, double* v_inout) const {
  const double u = *u_inout, v = *v_inout;
  const double r2 = u * u + v * v;
  if (!(r2 <= radius_limit_ * radius_limit_)) return false;
  double* x = u_inout;
  double* y = v_inout;
  switch (model_) {
    case CameraModelId::kSimpleRadial:
    case CameraModelId::kSimpleRadialFisheye: {
      const double factor = 1 + k_[0] * r2;
      *x = u * factor;
      *y = v * factor;
      return true;
    }
    case CameraModelId::kRadial:
    case CameraModelId::kRadialFisheye: {
      const double factor = 1 + r2 * (k_[0] + r2 * k_[1]);
      *x = u * factor;
      *y = v * factor;
      return true;
    }
    case CameraModelId::kOpenCv: {
      const double factor = 1 + r2 * (k_[0] + r2 * k_[1]);
      const double p1 = k_[2], p2 = k_[3];
      *x = u * factor + 2 * p1 * u * v + p2 * (r2 + 2 * u * u);
      *y = v * factor + 2 * p2 * u * v + p1 * (r2 + 2 * v * v);
      return true;
    }
    case CameraModelId::kOpenCvFisheye: {
      const double factor = 1 + r2 * (k_[0] + r2 * (k_[1] + r2 * (k_[2] + r2 * k_[3])));
      *x = u * factor;
      *y = v * factor;
      return true;
    }
    case CameraModelId::kFullOpenCv: {
      const double denominator = 1 + r2 * (k_[5] + r2 * (k_[6] + r2 * k_[7]));
      if (!(denominator > kEpsilon)) return false;
      const double factor = (1 + r2 * (k_[0] + r2 * (k_[1] + r2 * k_[4]))) / denominator;
      const double p1 = k_[2], p2 = k_[3];
      *x = u * factor + 2 * p1 * u * v + p2 * (r2 + 2 * u * u);
      *y = v * factor + 2 * p2 * u * v + p1 * (r2 + 2 * v * v);
      return true;
    }
    case CameraModelId::kFov: {
      const double omega = k_[0];
      double factor;
      if (omega * omega < 1e-4) {
        factor = omega * omega * r2 / 3 - omega * omega / 12 + 1;
      } else if (r2 < 1e-4) {
        const double t = std::tan(omega / 2);
        factor = -2 * t * (4 * r2 * t * t - 3) / (3 * omega);
      } else {
        const double r = std::sqrt(r2);
        factor = std::atan(2 * r * std::tan(omega / 2)) / (r * omega);
      }
      *x = u * factor;
      *y = v * factor;
      return true;
    }
    case CameraModelId::kThinPrismFisheye: {
      const double factor = 1 + r2 * (k_[0] + r2 * (k_[1] + r2 * (k_[4] + r2 * k_[5])));
      const double p1 = k_[2], p2 = k_[3];
      *x = u * factor + 2 * p1 * u * v + p2 * (r2 + 2 * u * u) + k_[6] * r2;
      *y = v * factor + 2 * p2 * u * v + p1 * (r2 + 2 * v * v) + k_[7] * r2;
      return true;
    }
    case CameraModelId::kRadTanThinPrismFisheye: {
      double factor = 0;
      for (int i = 5; i >= 0; --i) factor = (factor + k_[i]) * r2;
      factor += 1;
      const double a = u * factor, b = v * factor;  // tangential and thin prism act on these
      const double q2 = a * a + b * b;
      const double p0 = k_[6], p1 = k_[7];
      *x = a + 2 * p1 * a * b + p0 * (q2 + 2 * a * a) + q2 * (k_[8] + q2 * k_[9]);
      *y = b + 2 * p0 * a * b + p1 * (q2 + 2 * b * b) + q2 * (k_[10] + q2 * k_[11]);
      return true;
    }
    default:
      return true;
  }
}

bool CameraProjector::Project(const Vec3d& p, double* x, double* y) const {
  double u, v;
  switch (model_) {
    case CameraModelId::kEquirectangular: {
      const double horizontal = std::hypot(p.x, p.z);
      if (!(horizontal + std::abs(p.y) > kEpsilon)) return false;
      *x = (std::atan2(p.x, p.z) / (2 * std::numbers::pi) + 0.5) * fx_;
      *y = (0.5 - std::atan2(-p.y, horizontal) / std::numbers::pi) * fy_;
      return true;
    }
    case CameraModelId::kSimpleDivision:
    case CameraModelId::kDivision: {
      const double discriminant = p.z * p.z - 4 * k_[0] * (p.x * p.x + p.y * p.y);
      if (!(discriminant >= 0)) return false;
      const double w = p.z + std::sqrt(discriminant);
      if (!(w > kEpsilon)) return false;
      u = 2 * p.x / w;
      v = 2 * p.y / w;
      break;
    }
    case CameraModelId::kEucm: {
      if (!(p.z > kEpsilon)) return false;
      const double rho2 = k_[1] * (p.x * p.x + p.y * p.y) + p.z * p.z;
      if (!(rho2 >= 0)) return false;
      const double w = k_[0] * std::sqrt(rho2) + (1 - k_[0]) * p.z;
      if (!(w > kEpsilon)) return false;
      u = p.x / w;
      v = p.y / w;
      break;
    }
    case CameraModelId::kOpenCvFisheye:
    case CameraModelId::kSimpleRadialFisheye:
    case CameraModelId::kRadialFisheye:
    case CameraModelId::kThinPrismFisheye:
    case CameraModelId::kRadTanThinPrismFisheye:
    case CameraModelId::kSimpleFisheye:
    case CameraModelId::kFisheye: {
      if (!(p.z > kEpsilon)) return false;
      u = p.x / p.z;
      v = p.y / p.z;
      const double r = std::sqrt(u * u + v * v);
      const double factor = r > kEpsilon ? std::atan(r) / r : 1.0;
      u *= factor;
      v *= factor;
      if (!Distort(&u, &v)) return false;
      break;
    }
    default:
      if (!(p.z > kEpsilon)) return false;
      u = p.x / p.z;
      v = p.y / p.z;
      if (!Distort(&u, &v)) return false;
      break;
  }
  *x = fx_ * u + cx_;
  *y = fy_ * v + cy_;
  return std::isfinite(*x) && std::isfinite(*y);
}

}  // namespace sherd
