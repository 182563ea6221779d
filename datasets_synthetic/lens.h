// The cameras the photographs are taken with: COLMAP's OPENCV model (or PINHOLE when there is no
// distortion), and the pinhole camera of the undistorted picture. Image coordinates: upper-left
// corner (0, 0), first pixel's centre (0.5, 0.5).
#pragma once

#include <cstdint>
#include <vector>

namespace sherd::synthetic {

struct Lens {
  std::uint32_t camera_id = 1;
  int width = 0, height = 0;
  double fx = 1, fy = 1, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;

  bool distorted() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0; }
  // Image coordinates of the direction (u, v, 1) in the camera's frame; false outside the
  // field that the picture shows, where the polynomial would fold points back into it.
  bool Project(double u, double v, double* x, double* y) const;
  // The direction (u, v, 1) seen at image coordinates (x, y); Newton's method to 1e-14.
  void Unproject(double x, double y, double* u, double* v) const;
  // COLMAP's parameters: fx, fy, cx, cy and, when distorted, k1, k2, p1, p2.
  std::vector<double> Params() const;

  // The largest |(u, v)| any pixel sees; set by the makers below.
  double max_radius = 0;
  void SetMaxRadius();
};

// The pinhole camera of the undistorted picture: the same focal lengths, cut so that every pixel
// has a source (colmap image_undistorter with --blank_pixels 0). An undistorted lens is copied.
Lens UndistortedLens(const Lens& lens);
// The same view on w x h pixels.
Lens ResizedLens(const Lens& lens, int w, int h);

}  // namespace sherd::synthetic
