// A camera made ready for many projections.
#pragma once

#include <array>

#include "metaball/vec.h"
#include "reconstruction/camera_model.h"

namespace sherd {

// The projection of COLMAP's camera models (colmap/src/colmap/sensor/models.h), limited to where
// the radial distortion still grows: beyond its turning point a polynomial folds points from far
// outside the field of view back into the picture, and COLMAP itself does not stop them.
class CameraProjector {
 public:
  explicit CameraProjector(const SurveyCamera& camera);

  // As SurveyCamera::Project. Thread-safe.
  bool Project(const Vec3d& point_in_camera, double* x, double* y) const;

  // The largest undistorted radius (tangent of the angle for the pinhole family, the angle in
  // radians for the fisheye family) that is projected; infinity where the model has no limit.
  double radius_limit() const { return radius_limit_; }

 private:
  bool Distort(double* u, double* v) const;

  CameraModelId model_;
  double fx_ = 1, fy_ = 1, cx_ = 0, cy_ = 0;
  std::array<double, 12> k_{};  // the distortion, in COLMAP's order
  double radius_limit_;
};

}  // namespace sherd
