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
  bool Project(const Vec3d& point_in_camera, double* x, double* y) const {
    return lens_.Project(point_in_camera, x, y);
  }
  // As SurveyCamera::Unproject.
  bool Unproject(double x, double y, Vec3d* direction_in_camera) const;

  // The largest undistorted radius (tangent of the angle for the pinhole family, the angle in
  // radians for the fisheye family) that is projected; infinity where the model has no limit.
  double radius_limit() const { return lens_.radius_limit; }
  const Lens& lens() const { return lens_; }

 private:
  LensDistortion distortion_;
  Lens lens_;
};

}  // namespace sherd
