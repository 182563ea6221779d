#include "reconstruction/lens_distortion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sherd {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
using Coefficients = std::array<double, 12>;

// A number and its derivatives by u and v: the formulas below give the Jacobian with it.
struct Dual {
  double value = 0, by_u = 0, by_v = 0;

  Dual() = default;
  Dual(double v) : value(v) {}  // NOLINT: constants mix with variables as in plain formulas
  Dual(double v, double u_part, double v_part) : value(v), by_u(u_part), by_v(v_part) {}

  friend Dual operator+(const Dual& a, const Dual& b) {
    return {a.value + b.value, a.by_u + b.by_u, a.by_v + b.by_v};
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    return {a.value - b.value, a.by_u - b.by_u, a.by_v - b.by_v};
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, a.by_u * b.value + a.value * b.by_u,
            a.by_v * b.value + a.value * b.by_v};
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double q = a.value / b.value;
    return {q, (a.by_u - q * b.by_u) / b.value, (a.by_v - q * b.by_v) / b.value};
  }
};

Dual sqrt(const Dual& a) {
  const double root = std::sqrt(a.value);
  return {root, 0.5 * a.by_u / root, 0.5 * a.by_v / root};
}
Dual atan(const Dual& a) {
  const double slope = 1 / (1 + a.value * a.value);
  return {std::atan(a.value), slope * a.by_u, slope * a.by_v};
}
double ValueOf(double a) { return a; }
double ValueOf(const Dual& a) { return a.value; }

template <class T>
T FovFactor(double omega, const T& r2) {
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

// The formulas, in one place for values and derivatives.
template <class T>
bool Distorted(CameraModelId model, const Coefficients& k, const T& u, const T& v, T* x, T* y) {
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
      if (!(ValueOf(denominator) > kEpsilon)) return false;
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

// Positive where the distortion keeps the orientation, that is, has not folded.
double Determinant(const Dual& x, const Dual& y) { return x.by_u * y.by_v - x.by_v * y.by_u; }

bool IsOneToOneAt(CameraModelId model, const Coefficients& k, double u, double v) {
  Dual x, y;
  return Distorted(model, k, Dual(u, 1, 0), Dual(v, 0, 1), &x, &y) && Determinant(x, y) > 0;
}

// Whether a point on the axis' side depends on its direction, not on its distance alone.
bool HasDirection(CameraModelId model, const Coefficients& k) {
  switch (model) {
    case CameraModelId::kOpenCv:
    case CameraModelId::kFullOpenCv:
      return k[2] != 0 || k[3] != 0;
    case CameraModelId::kThinPrismFisheye:
      return k[2] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0;
    case CameraModelId::kRadTanThinPrismFisheye:
      return std::any_of(k.begin() + 6, k.end(), [](double c) { return c != 0; });
    default:
      return false;
  }
}

double RadiusLimit(CameraModelId model, const Coefficients& k) {
  if (model == CameraModelId::kFov && k[0] * k[0] >= 1e-4) return kInfinity;  // always grows
  const bool fisheye = IsFisheye(model);
  constexpr int kSteps = 512;
  const auto radius = [&](double step) {
    const double angle = step / kSteps * (std::numbers::pi / 2) * 0.9999;
    return fisheye ? angle : std::tan(angle);
  };
  // A distortion by the distance alone is the same in every direction.
  const int directions = HasDirection(model, k) ? 16 : 1;
  double limit = kInfinity;
  for (int d = 0; d < directions; ++d) {
    const double phi = 2 * std::numbers::pi * d / directions;
    const double c = std::cos(phi), s = std::sin(phi);
    const auto holds = [&](double step) {
      return IsOneToOneAt(model, k, radius(step) * c, radius(step) * s);
    };
    for (int i = 1; i <= kSteps && radius(i - 1) < limit; ++i) {
      if (holds(i)) continue;
      double lo = i - 1, hi = i;
      for (int j = 0; j < 50; ++j) (holds(0.5 * (lo + hi)) ? lo : hi) = 0.5 * (lo + hi);
      limit = std::min(limit, radius(lo));
      break;
    }
  }
  return limit;
}

std::size_t FirstCoefficient(CameraModelId model) {
  switch (model) {
    case CameraModelId::kSimplePinhole:
    case CameraModelId::kSimpleRadial:
    case CameraModelId::kRadial:
    case CameraModelId::kSimpleRadialFisheye:
    case CameraModelId::kRadialFisheye:
    case CameraModelId::kSimpleDivision:
    case CameraModelId::kSimpleFisheye:
      return 3;
    case CameraModelId::kEquirectangular:
      return 2;
    default:
      return 4;
  }
}

}  // namespace

bool IsFisheye(CameraModelId model) {
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

LensDistortion::LensDistortion(CameraModelId model, const std::vector<double>& parameters)
    : model_(model) {
  const std::size_t first = FirstCoefficient(model);
  for (std::size_t i = first; i < parameters.size() && i - first < k_.size(); ++i) {
    k_[i - first] = parameters[i];
  }
  // The coefficients of the division model and of EUCM are no such distortion.
  identity_ = std::all_of(k_.begin(), k_.end(), [](double c) { return c == 0; });
  const bool other = model == CameraModelId::kSimpleDivision || model == CameraModelId::kDivision ||
                     model == CameraModelId::kEucm;
  radius_limit_ = identity_ || other ? kInfinity : RadiusLimit(model, k_);
}

bool LensDistortion::Apply(double u, double v, double* x, double* y) const {
  if (!(u * u + v * v <= radius_limit_ * radius_limit_)) return false;
  if (identity_) {
    *x = u;
    *y = v;
    return true;
  }
  return Distorted(model_, k_, u, v, x, y);
}

double LensDistortion::InvertRadial(double distorted) const {
  Coefficients radial = k_;  // the terms of the distance alone
  if (HasDirection(model_, k_)) {
    if (model_ == CameraModelId::kRadTanThinPrismFisheye) {
      std::fill(radial.begin() + 6, radial.end(), 0.0);
    } else {
      radial[2] = radial[3] = 0;
      if (model_ == CameraModelId::kThinPrismFisheye) radial[6] = radial[7] = 0;
    }
  }
  const auto reaches = [&](double r) {
    double x, y;
    return !Distorted(model_, radial, r, 0.0, &x, &y) || x >= distorted;
  };
  double hi = radius_limit_;
  if (std::isinf(hi)) {
    constexpr double kFarthest = 1e8;  // half a millionth of a degree from the image plane
    hi = IsFisheye(model_) ? std::numbers::pi / 2 : std::max(1.0, distorted);
    while (!IsFisheye(model_) && hi < kFarthest && !reaches(hi)) hi *= 2;
  }
  if (!reaches(hi)) return -1;
  double lo = 0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (lo + hi);
    (reaches(middle) ? hi : lo) = middle;
  }
  return 0.5 * (lo + hi);
}

bool LensDistortion::Invert(double x, double y, double* u_out, double* v_out) const {
  const double distorted = std::hypot(x, y);
  if (!std::isfinite(distorted)) return false;
  double u = x, v = y;
  if (identity_) {
    *u_out = u;
    *v_out = v;
    return true;
  }
  if (distorted > 0) {
    const double radius = InvertRadial(distorted);
    if (radius < 0) return false;
    u *= radius / distorted;
    v *= radius / distorted;
  }
  // Damped Newton from the solution of the radial terms.
  const auto miss = [&](double at_u, double at_v) {
    double dx, dy;
    if (!Apply(at_u, at_v, &dx, &dy)) return kInfinity;
    return std::hypot(dx - x, dy - y);
  };
  const double good = 1e-15 * (1 + distorted), enough = 1e-11 * (1 + distorted);
  double error = miss(u, v);
  for (int i = 0; i < 100 && error > good; ++i) {
    Dual dx, dy;
    if (!Distorted(model_, k_, Dual(u, 1, 0), Dual(v, 0, 1), &dx, &dy)) return false;
    const double determinant = Determinant(dx, dy);
    if (!(determinant > 0)) break;
    const double ex = dx.value - x, ey = dy.value - y;
    const double step_u = (dy.by_v * ex - dx.by_v * ey) / determinant;
    const double step_v = (dx.by_u * ey - dy.by_u * ex) / determinant;
    double share = 1;
    while (share > 1e-6 && !(miss(u - share * step_u, v - share * step_v) < error)) share /= 2;
    if (share <= 1e-6) break;
    u -= share * step_u;
    v -= share * step_v;
    error = miss(u, v);
  }
  if (!(error <= enough)) return false;
  *u_out = u;
  *v_out = v;
  return true;
}

}  // namespace sherd
