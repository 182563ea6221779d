#include "app/desktop/camera_controller.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace sherd {
namespace {

constexpr double kFitMargin = 1.08;

// Rodrigues' rotation of v about the unit axis.
Vec3d Rotated(const Vec3d& v, const Vec3d& axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return v * c + Cross(axis, v) * s + axis * (Dot(axis, v) * (1.0 - c));
}

// Repeated rotations drift; the forward axis is the one to keep.
void Orthonormalise(CameraState* state) {
  state->forward = Normalized(state->forward);
  state->right = Normalized(state->right - state->forward * Dot(state->right, state->forward));
  state->down = Cross(state->forward, state->right);
}

// Pixels per unit of slope (perspective) for the shorter side.
double FocalPixels(double view_angle, int width, int height) {
  return 0.5 * std::min(width, height) / std::tan(0.5 * view_angle);
}

// The values that a hundredth, and all but a hundredth, of `values` reach; all of few values.
std::pair<double, double> CentralRange(std::vector<double>* values) {
  const auto last = static_cast<std::ptrdiff_t>(values->size()) - 1;
  const std::ptrdiff_t cut = (last + 1) / 100;
  std::nth_element(values->begin(), values->begin() + cut, values->end());
  const double low = (*values)[static_cast<std::size_t>(cut)];
  std::nth_element(values->begin(), values->begin() + last - cut, values->end());
  return {low, (*values)[static_cast<std::size_t>(last - cut)]};
}

}  // namespace

Camera Letterboxed(const Camera& camera, int width, int height) {
  const double scale = std::min(static_cast<double>(width) / camera.width,
                                static_cast<double>(height) / camera.height);
  Camera result = camera;
  result.width = width;
  result.height = height;
  result.fx = camera.fx * scale;
  result.fy = camera.fy * scale;
  result.cx = camera.cx * scale + 0.5 * (width - camera.width * scale);
  result.cy = camera.cy * scale + 0.5 * (height - camera.height * scale);
  return result;
}

void CameraController::SetScene(const Box3d& bounds, const Vec3d& up) {
  bounds_ = bounds;
  up_ = Normalized(up, Vec3d{0, 0, 1});
}

double CameraController::SceneSize() const {
  const double diagonal = bounds_.Diagonal();
  return diagonal > 0 && std::isfinite(diagonal) ? diagonal : 1.0;
}

void CameraController::SetState(const CameraState& state) { state_ = state; }

Camera CameraController::MakeCamera(int width, int height) const {
  Camera camera;
  camera.width = std::max(width, 1);
  camera.height = std::max(height, 1);
  camera.projection = state_.projection;
  camera.right = state_.right;
  camera.down = state_.down;
  camera.forward = state_.forward;
  camera.cx = 0.5 * camera.width;
  camera.cy = 0.5 * camera.height;
  if (state_.projection == Projection::kOrthographic) {
    const double extent = 2.0 * state_.distance * std::tan(0.5 * state_.view_angle);
    camera.fx = camera.fy = std::min(camera.width, camera.height) / extent;
    const double away = Length(state_.target - bounds_.Center());
    camera.eye = state_.target - state_.forward * (state_.distance + away + 2.0 * SceneSize());
    return camera;
  }
  camera.eye = state_.eye();
  if (state_.film) {
    const PhotoFilm& film = *state_.film;
    Camera whole = camera;
    whole.width = film.width;
    whole.height = film.height;
    whole.fx = film.fx;
    whole.fy = film.fy;
    whole.cx = film.cx;
    whole.cy = film.cy;
    camera = Letterboxed(whole, camera.width, camera.height);
  } else {
    camera.fx = camera.fy = FocalPixels(state_.view_angle, camera.width, camera.height);
  }
  return camera;
}

void CameraController::LookAlong(const Camera& camera, int width, int height) {
  state_.right = camera.right;
  state_.down = camera.down;
  state_.forward = camera.forward;
  Orthonormalise(&state_);
  Fit(width, height);
}

void CameraController::LookThrough(const Camera& photograph) {
  state_.projection = Projection::kPerspective;
  state_.right = photograph.right;
  state_.down = photograph.down;
  state_.forward = photograph.forward;
  Orthonormalise(&state_);
  const double depth = Dot(bounds_.Center() - photograph.eye, state_.forward);
  state_.distance = depth > 1e-3 * SceneSize() ? depth : 0.5 * SceneSize();
  state_.target = photograph.eye + state_.forward * state_.distance;
  state_.film = PhotoFilm{photograph.width, photograph.height, photograph.fx,
                          photograph.fy,    photograph.cx,     photograph.cy};
  state_.view_angle = 2.0 * std::atan(0.5 * std::min(photograph.width / photograph.fx,
                                                     photograph.height / photograph.fy));
}

void CameraController::Orbit(double yaw, double pitch, const Vec3d& pivot) {
  // The scene turns one way, so the camera turns the other.
  const double elevation = std::asin(std::clamp(-Dot(state_.forward, up_), -1.0, 1.0));
  const double limit = 0.5 * std::numbers::pi;
  // With a level horizon the poles are where to stop; a photograph held aslant has no such limit.
  const bool level = std::abs(Dot(state_.right, up_)) < 1e-6;
  double turn = pitch;
  if (level) {
    const bool upside_down = Dot(state_.down, up_) > 1e-9;
    const double room_up = limit - elevation, room_down = limit + elevation;
    turn =
        upside_down ? std::clamp(turn, -room_up, room_down) : std::clamp(turn, -room_down, room_up);
  }
  const Vec3d pitch_axis = state_.right;
  const auto rotate = [&](const Vec3d& v) {
    return Rotated(Rotated(v, pitch_axis, -turn), up_, -yaw);
  };
  state_.target = pivot + rotate(state_.target - pivot);
  state_.right = rotate(state_.right);
  state_.down = rotate(state_.down);
  state_.forward = rotate(state_.forward);
  Orthonormalise(&state_);
}

void CameraController::Pan(double dx_px, double dy_px, const Vec3d& anchor, int width, int height) {
  const Camera camera = MakeCamera(width, height);
  double depth = Dot(anchor - camera.eye, camera.forward);
  if (!(depth > 0)) depth = state_.distance;
  const double scale = camera.projection == Projection::kOrthographic ? 1.0 : depth;
  state_.target = state_.target - state_.right * (dx_px * scale / camera.fx) -
                  state_.down * (dy_px * scale / camera.fy);
}

void CameraController::ZoomAt(const Vec3d& anchor, double factor) {
  if (!(factor > 0) || !std::isfinite(factor)) return;
  const double size = SceneSize();
  const double distance = std::clamp(state_.distance * factor, 1e-5 * size, 100.0 * size);
  const double applied = distance / state_.distance;
  state_.target = anchor + (state_.target - anchor) * applied;
  state_.distance = distance;
}

void CameraController::CenterOn(const Vec3d& point) { state_.target = point; }

void CameraController::Fit(int width, int height) {
  state_.film.reset();
  std::vector<Vec3d> points;
  if (shape_ && !shape_->empty()) {
    points = *shape_;
  } else {
    for (int corner = 0; corner < 8; ++corner) {
      points.push_back({corner & 1 ? bounds_.max.x : bounds_.min.x,
                        corner & 2 ? bounds_.max.y : bounds_.min.y,
                        corner & 4 ? bounds_.max.z : bounds_.min.z});
    }
  }
  // The middle of what is there, across the picture and in depth.
  const Vec3d center = bounds_.Center();
  const auto middle = [&](const Vec3d& axis) {
    std::vector<double> along(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) along[i] = Dot(points[i] - center, axis);
    const auto [low, high] = CentralRange(&along);
    return axis * (0.5 * (low + high));
  };
  state_.target = center + middle(state_.right) + middle(state_.down) + middle(state_.forward);
  const double focal = FocalPixels(state_.view_angle, width, height);
  const double tan_x = 0.5 * width / focal, tan_y = 0.5 * height / focal;
  std::vector<double> distances(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3d v = points[i] - state_.target;
    const double needed =
        std::max(std::abs(Dot(v, state_.right)) / tan_x, std::abs(Dot(v, state_.down)) / tan_y) *
        kFitMargin;
    const double nearer =
        state_.projection == Projection::kPerspective ? Dot(v, state_.forward) : 0.0;
    distances[i] = needed - nearer;
  }
  const double distance = CentralRange(&distances).second;
  state_.distance = distance > 0 && std::isfinite(distance) ? distance : SceneSize();
}

void CameraController::SetProjection(Projection projection) {
  if (projection == Projection::kOrthographic) state_.film.reset();
  state_.projection = projection;
}

void CameraController::SetViewAngle(double view_angle) {
  const double extent = state_.distance * std::tan(0.5 * state_.view_angle);
  state_.film.reset();
  state_.view_angle = view_angle;
  state_.distance = extent / std::tan(0.5 * view_angle);
}

Vec3d CameraController::PointAtTargetDepth(double x_px, double y_px, int width, int height) const {
  const Camera camera = MakeCamera(width, height);
  const RayD ray = RayThrough(camera, x_px, y_px);
  const double along = Dot(ray.direction, camera.forward);
  return ray.origin + ray.direction * (Dot(state_.target - ray.origin, camera.forward) / along);
}

}  // namespace sherd
