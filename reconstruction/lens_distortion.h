// The distortion of COLMAP's camera models (colmap/src/colmap/sensor/models.h) and its inverse.
// Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/photo/lens.h"
#include "reconstruction/camera_model.h"

namespace sherd {

// Acts on coordinates before focal length and principal point: tangents of the pinhole family
// (u = X / Z), angles of the fisheye family ((u, v) as long as the angle from the axis in radians).
// Models without such a distortion (pinholes, division, EUCM, panoramas) leave them as they are.
// Thread-safe.
class LensDistortion {
 public:
  // `parameters` are all of the camera's.
  LensDistortion(CameraModelId model, const std::vector<double>& parameters);

  // False beyond radius_limit() and where a rational model has no value.
  bool Apply(double u, double v, double* x, double* y) const { return lens_.Distort(u, v, x, y); }
  // The (u, v) within radius_limit() that Apply takes to (x, y), to about 1e-11; false where there
  // is none.
  bool Invert(double x, double y, double* u, double* v) const;

  // How far from the axis the distortion is one-to-one, in every direction: where its determinant
  // first vanishes. Beyond, a polynomial folds points from far outside the field of view back into
  // the picture, which COLMAP itself does not stop. Infinity where there is no such place.
  double radius_limit() const { return lens_.radius_limit; }
  // Model, coefficients and limit; focal lengths 1, principal point 0.
  const Lens& lens() const { return lens_; }

 private:
  // The length of (u, v) that the radial terms alone take to `distorted`; negative: there is none.
  double InvertRadial(double distorted) const;

  Lens lens_;
};

}  // namespace sherd
