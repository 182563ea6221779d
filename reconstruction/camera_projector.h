// A camera made ready for many projections.
#pragma once

#include "metaball/vec.h"
#include "reconstruction/camera_model.h"
#include "reconstruction/lens_distortion.h"

namespace sherd {

// The projection of COLMAP's camera models (colmap/src/colmap/sensor/models.h) and its inverse,
// limited to where they are one-to-one (LensDistortion::radius_limit). Thread-safe.
class CameraProjector {
 public:
  explicit CameraProjector(const SurveyCamera& camera);

  // As SurveyCamera::Project.
  bool Project(const Vec3d& point_in_camera, double* x, double* y) const;
  // As SurveyCamera::Unproject.
  bool Unproject(double x, double y, Vec3d* direction_in_camera) const;

  // The largest undistorted radius (tangent of the angle for the pinhole family, the angle in
  // radians for the fisheye family) that is projected; infinity where the model has no limit.
  double radius_limit() const { return distortion_.radius_limit(); }

 private:
  CameraModelId model_;
  double fx_ = 1, fy_ = 1, cx_ = 0, cy_ = 0;
  LensDistortion distortion_;
};

}  // namespace sherd
