// Where the user looks from: target, orientation, distance. No widget and no Qt inside.
//
// World coordinates; camera axes right, down, forward; pixels from the upper-left corner, pixel
// centres at (0.5, 0.5). Angles in radians.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "metaball/camera.h"
#include "reconstruction/survey.h"

namespace sherd {

// The intrinsics of a photograph one looks through: kept as they are, letter-boxed into the view.
struct PhotoFilm {
  int width = 0, height = 0;  // pixels, > 0
  double fx = 1, fy = 1, cx = 0, cy = 0;
  friend bool operator==(const PhotoFilm&, const PhotoFilm&) = default;
};

struct CameraState {
  Vec3d target{};  // what orbit and zoom refer to when nothing else is said
  Vec3d right{1, 0, 0}, down{0, 1, 0}, forward{0, 0, 1};  // orthonormal
  double distance = 1.0;  // from the eye to the target along `forward`, world units, > 0
  Projection projection = Projection::kPerspective;
  double view_angle = 0.8726646259971648;  // across the shorter side of the picture, (0, pi)
  std::optional<PhotoFilm> film;           // perspective only; then view_angle is not used

  Vec3d eye() const { return target - forward * distance; }
  friend bool operator==(const CameraState&, const CameraState&) = default;
};

// The camera that shows all of `camera`'s picture, as large as it fits, in the middle of
// width x height pixels.
Camera Letterboxed(const Camera& camera, int width, int height);

class CameraController {
 public:
  // What Fit shows and what limits the distance; `up` is the axis orbits turn about.
  void SetScene(const Box3d& bounds, const Vec3d& up);
  // A few thousand points of the scene: Fit then frames what is there instead of its box. Null:
  // the box.
  void SetShape(std::shared_ptr<const std::vector<Vec3d>> points) { shape_ = std::move(points); }
  const Box3d& bounds() const { return bounds_; }
  const Vec3d& up() const { return up_; }

  const CameraState& state() const { return state_; }
  void SetState(const CameraState& state);

  // The camera for a picture of width x height pixels (both >= 1). Orthographic eyes are moved
  // back so that the whole scene lies in front of the picture plane.
  Camera MakeCamera(int width, int height) const;

  // Takes the axes of `camera`, keeps the projection and fits the scene into width x height.
  void LookAlong(const Camera& camera, int width, int height);
  // Takes pose and intrinsics of a photograph; the target is put at the depth of the scene's
  // centre.
  void LookThrough(const Camera& photograph);

  // Turns eye and target about `pivot`: `yaw` about up (positive: the scene turns to the right),
  // `pitch` about the camera's right axis (positive: the scene's top tips towards the viewer). The
  // pivot keeps its place in the picture. The view is not tipped over the poles.
  void Orbit(double yaw, double pitch, const Vec3d& pivot);
  // Moves the camera so that `anchor`, a world point, moves by (dx, dy) pixels in a picture of
  // width x height.
  void Pan(double dx_px, double dy_px, const Vec3d& anchor, int width, int height);
  // Scales the distances from `anchor` by `factor` (< 1 nears); the anchor keeps its place in the
  // picture. The distance stays between 1e-5 and 100 scene sizes.
  void ZoomAt(const Vec3d& anchor, double factor);
  // Moves the camera, its orientation and distance kept, so that `point` is the middle of the view.
  void CenterOn(const Vec3d& point);
  // Keeps orientation, moves so that the scene just fits into width x height with a small margin.
  // A hundredth of the shape's points may stay outside: strays must not push the rest away.
  void Fit(int width, int height);
  // Keeps the size of what is at the target.
  void SetProjection(Projection projection);
  // Keeps the size of what is at the target (by moving the eye). Angle in (0, pi).
  void SetViewAngle(double view_angle);

  // The point on the ray of image coordinates (x, y) at the target's depth.
  Vec3d PointAtTargetDepth(double x_px, double y_px, int width, int height) const;

 private:
  double SceneSize() const;

  CameraState state_;
  std::shared_ptr<const std::vector<Vec3d>> shape_;
  Box3d bounds_{{-1, -1, -1}, {1, 1, 1}};
  Vec3d up_{0, 0, 1};
};

}  // namespace sherd
