#include "reconstruction/camera_projector.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace sherd {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kPi = std::numbers::pi;

bool IsDivision(CameraModelId model) {
  return model == CameraModelId::kSimpleDivision || model == CameraModelId::kDivision;
}

}  // namespace

CameraProjector::CameraProjector(const SurveyCamera& camera)
    : model_(camera.model), distortion_(camera.model, camera.parameters) {
  if (model_ == CameraModelId::kEquirectangular) {
    fx_ = camera.parameters[0];
    fy_ = camera.parameters[1];
  } else {
    camera.Pinhole(&fx_, &fy_, &cx_, &cy_);
  }
}

bool CameraProjector::Project(const Vec3d& p, double* x, double* y) const {
  const auto& k = distortion_.coefficients();
  double u, v;
  if (model_ == CameraModelId::kEquirectangular) {
    const double horizontal = std::hypot(p.x, p.z);
    if (!(horizontal + std::abs(p.y) > kEpsilon)) return false;
    *x = (std::atan2(p.x, p.z) / (2 * kPi) + 0.5) * fx_;
    *y = (0.5 - std::atan2(-p.y, horizontal) / kPi) * fy_;
    return true;
  }
  if (IsDivision(model_)) {
    const double discriminant = p.z * p.z - 4 * k[0] * (p.x * p.x + p.y * p.y);
    if (!(discriminant >= 0)) return false;
    const double w = p.z + std::sqrt(discriminant);
    if (!(w > kEpsilon)) return false;
    u = 2 * p.x / w;
    v = 2 * p.y / w;
  } else if (model_ == CameraModelId::kEucm) {
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
    if (IsFisheye(model_)) {
      const double r = std::sqrt(u * u + v * v);
      const double factor = r > kEpsilon ? std::atan(r) / r : 1.0;
      u *= factor;
      v *= factor;
    }
    if (!distortion_.Apply(u, v, &u, &v)) return false;
  }
  *x = fx_ * u + cx_;
  *y = fy_ * v + cy_;
  return std::isfinite(*x) && std::isfinite(*y);
}

bool CameraProjector::Unproject(double x, double y, Vec3d* direction) const {
  if (!std::isfinite(x) || !std::isfinite(y)) return false;
  const auto& k = distortion_.coefficients();
  if (model_ == CameraModelId::kEquirectangular) {
    if (x < 0 || y < 0 || x > fx_ || y > fy_) return false;
    const double theta = (x / fx_ - 0.5) * 2 * kPi, phi = (0.5 - y / fy_) * kPi;
    *direction = {std::cos(phi) * std::sin(theta), -std::sin(phi), std::cos(phi) * std::cos(theta)};
    return true;
  }
  double u = (x - cx_) / fx_, v = (y - cy_) / fy_, z = 1;
  const double r2 = u * u + v * v;
  if (IsDivision(model_)) {
    // Beyond k r^2 = 1 the projection would come from the other root.
    if (!(k[0] * r2 < 1)) return false;
    z = 1 + k[0] * r2;
  } else if (model_ == CameraModelId::kEucm) {
    const double alpha = k[0], beta = k[1];
    const double radicand = 1 - (2 * alpha - 1) * beta * r2;
    if (!(radicand > 0)) return false;
    const double denominator = alpha * std::sqrt(radicand) + 1 - alpha;
    if (!(denominator > kEpsilon)) return false;
    z = (1 - alpha * alpha * beta * r2) / denominator;
    if (!(z > kEpsilon)) return false;
  } else {
    if (!distortion_.Invert(u, v, &u, &v)) return false;
    if (IsFisheye(model_)) {
      const double angle = std::hypot(u, v);
      if (!(angle < kPi / 2)) return false;
      const double factor = angle > kEpsilon ? std::sin(angle) / angle : 1.0;
      u *= factor;
      v *= factor;
      z = std::cos(angle);
    }
  }
  const Vec3d ray{u, v, z};
  const double length = Length(ray);
  if (!(length > 0) || !std::isfinite(length)) return false;
  *direction = ray / length;
  return true;
}

}  // namespace sherd
