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
    : distortion_(camera.model, camera.parameters), lens_(distortion_.lens()) {
  if (lens_.model == CameraModelId::kEquirectangular) {
    lens_.fx = camera.parameters[0];
    lens_.fy = camera.parameters[1];
  } else {
    camera.Pinhole(&lens_.fx, &lens_.fy, &lens_.cx, &lens_.cy);
  }
}

bool CameraProjector::Unproject(double x, double y, Vec3d* direction) const {
  if (!std::isfinite(x) || !std::isfinite(y)) return false;
  const double* const k = lens_.k;
  if (lens_.model == CameraModelId::kEquirectangular) {
    if (x < 0 || y < 0 || x > lens_.fx || y > lens_.fy) return false;
    const double theta = (x / lens_.fx - 0.5) * 2 * kPi, phi = (0.5 - y / lens_.fy) * kPi;
    *direction = {std::cos(phi) * std::sin(theta), -std::sin(phi), std::cos(phi) * std::cos(theta)};
    return true;
  }
  double u = (x - lens_.cx) / lens_.fx, v = (y - lens_.cy) / lens_.fy, z = 1;
  const double r2 = u * u + v * v;
  if (IsDivision(lens_.model)) {
    // Beyond k r^2 = 1 the projection would come from the other root.
    if (!(k[0] * r2 < 1)) return false;
    z = 1 + k[0] * r2;
  } else if (lens_.model == CameraModelId::kEucm) {
    const double alpha = k[0], beta = k[1];
    const double radicand = 1 - (2 * alpha - 1) * beta * r2;
    if (!(radicand > 0)) return false;
    const double denominator = alpha * std::sqrt(radicand) + 1 - alpha;
    if (!(denominator > kEpsilon)) return false;
    z = (1 - alpha * alpha * beta * r2) / denominator;
    if (!(z > kEpsilon)) return false;
  } else {
    if (!distortion_.Invert(u, v, &u, &v)) return false;
    if (IsFisheye(lens_.model)) {
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
