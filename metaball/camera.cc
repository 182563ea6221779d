#include "metaball/camera.h"

#include <cmath>
#include <numbers>

#include "metaball/error.h"

namespace sherd {
namespace {

// Sets the axes of a camera that looks from eye to look_at.
void SetAxes(const Vec3d& eye, const Vec3d& look_at, const Vec3d& up, Camera* camera) {
  const Vec3d view = look_at - eye;
  // hypot: scenes of any scale, also where squares would leave the range of double.
  const double distance = std::hypot(view.x, view.y, view.z);
  if (!(distance > 0) || !std::isfinite(distance)) {
    throw Error("the camera's eye and the point it looks at must be finite and differ");
  }
  camera->eye = eye;
  camera->forward = view / distance;
  Vec3d right = Cross(camera->forward, Normalized(up));
  if (!(Length(right) > 1e-9)) {
    // Looking along `up`: take the world axis that is farthest from the view.
    const Vec3d f = camera->forward;
    const Vec3d axis = std::abs(f.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
    right = Cross(f, axis);
  }
  camera->right = Normalized(right);
  camera->down = Cross(camera->forward, camera->right);
}

void CheckSize(int width, int height) {
  if (width < 1 || height < 1) throw Error("a picture needs at least one pixel on each side");
}

}  // namespace

Camera Camera::LookAt(const Vec3d& eye, const Vec3d& look_at, const Vec3d& up, double fov_x_rad,
                      int width, int height) {
  CheckSize(width, height);
  if (!(fov_x_rad > 0 && fov_x_rad < std::numbers::pi)) {
    throw Error("the field of view must lie between 0 and 180 degrees");
  }
  Camera camera;
  camera.width = width;
  camera.height = height;
  SetAxes(eye, look_at, up, &camera);
  camera.fx = camera.fy = 0.5 * width / std::tan(0.5 * fov_x_rad);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

Camera Camera::LookAtOrthographic(const Vec3d& eye, const Vec3d& look_at, const Vec3d& up,
                                  double ortho_width, int width, int height) {
  CheckSize(width, height);
  if (!(ortho_width > 0) || !std::isfinite(ortho_width)) {
    throw Error("the width of an orthographic picture must be positive");
  }
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.width = width;
  camera.height = height;
  SetAxes(eye, look_at, up, &camera);
  camera.fx = camera.fy = width / ortho_width;
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

Camera Camera::Resized(int new_width, int new_height) const {
  CheckSize(new_width, new_height);
  Camera c = *this;
  const double sx = static_cast<double>(new_width) / width;
  const double sy = static_cast<double>(new_height) / height;
  c.width = new_width;
  c.height = new_height;
  c.fx *= sx;
  c.cx *= sx;
  c.fy *= sy;
  c.cy *= sy;
  return c;
}

Camera Camera::Cropped(int x0, int y0, int w, int h) const {
  CheckSize(w, h);
  Camera c = *this;
  c.cx -= x0;
  c.cy -= y0;
  c.width = w;
  c.height = h;
  return c;
}

}  // namespace sherd
