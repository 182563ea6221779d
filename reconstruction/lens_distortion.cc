#include "reconstruction/lens_distortion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sherd {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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
double ValueOf(const Dual& a) { return a.value; }

// Positive where the distortion keeps the orientation, that is, has not folded.
double Determinant(const Dual& x, const Dual& y) { return x.by_u * y.by_v - x.by_v * y.by_u; }

bool IsOneToOneAt(CameraModelId model, const double* k, double u, double v) {
  Dual x, y;
  return Distorted(model, k, Dual(u, 1, 0), Dual(v, 0, 1), &x, &y) && Determinant(x, y) > 0;
}

// Whether a point on the axis' side depends on its direction, not on its distance alone.
bool HasDirection(CameraModelId model, const double* k) {
  switch (model) {
    case CameraModelId::kOpenCv:
    case CameraModelId::kFullOpenCv:
      return k[2] != 0 || k[3] != 0;
    case CameraModelId::kThinPrismFisheye:
      return k[2] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0;
    case CameraModelId::kRadTanThinPrismFisheye:
      return std::any_of(k + 6, k + 12, [](double c) { return c != 0; });
    default:
      return false;
  }
}

double RadiusLimit(CameraModelId model, const double* k) {
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

LensDistortion::LensDistortion(CameraModelId model, const std::vector<double>& parameters) {
  lens_.model = model;
  const std::size_t first = FirstCoefficient(model);
  for (std::size_t i = first; i < parameters.size() && i - first < std::size(lens_.k); ++i) {
    lens_.k[i - first] = parameters[i];
  }
  // The coefficients of the division model and of EUCM are no such distortion.
  lens_.distorts =
      std::any_of(std::begin(lens_.k), std::end(lens_.k), [](double c) { return c != 0; });
  const bool other = model == CameraModelId::kSimpleDivision || model == CameraModelId::kDivision ||
                     model == CameraModelId::kEucm;
  if (lens_.distorts && !other) lens_.radius_limit = RadiusLimit(model, lens_.k);
}

double LensDistortion::InvertRadial(double distorted) const {
  Lens radial = lens_;  // the terms of the distance alone
  if (HasDirection(lens_.model, lens_.k)) {
    if (lens_.model == CameraModelId::kRadTanThinPrismFisheye) {
      std::fill(radial.k + 6, radial.k + 12, 0.0);
    } else {
      radial.k[2] = radial.k[3] = 0;
      if (lens_.model == CameraModelId::kThinPrismFisheye) radial.k[6] = radial.k[7] = 0;
    }
  }
  const auto reaches = [&](double r) {
    double x, y;
    return !Distorted(radial.model, radial.k, r, 0.0, &x, &y) || x >= distorted;
  };
  double hi = lens_.radius_limit;
  if (std::isinf(hi)) {
    constexpr double kFarthest = 1e8;  // half a millionth of a degree from the image plane
    hi = IsFisheye(lens_.model) ? std::numbers::pi / 2 : std::max(1.0, distorted);
    while (!IsFisheye(lens_.model) && hi < kFarthest && !reaches(hi)) hi *= 2;
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
  if (!lens_.distorts) {
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
    if (!Distorted(lens_.model, lens_.k, Dual(u, 1, 0), Dual(v, 0, 1), &dx, &dy)) return false;
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
