// Cameras. World coordinates; axes right, down, forward (COLMAP's); pixel centres at (0.5, 0.5);
// x to the right and y down from the upper-left corner of the image.
#pragma once

#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

enum class Projection { kPerspective, kOrthographic };

struct Camera {
  Projection projection = Projection::kPerspective;
  int width = 0, height = 0;  // pixels, both >= 1
  Vec3d eye{};  // world; orthographic: the picture plane's origin, nothing behind it is seen
  Vec3d right{1, 0, 0}, down{0, 1, 0}, forward{0, 0, 1};  // world, orthonormal
  // Perspective: focal lengths in pixels. Orthographic: pixels per world unit. Both > 0.
  double fx = 1, fy = 1;
  double cx = 0, cy = 0;  // principal point, pixels

  // fov_x_rad: the horizontal angle, in (0, pi). `up` need not be orthogonal to the view; where it
  // is parallel to it another axis is chosen. Throws Error on a zero-length view or an angle out of
  // range.
  static Camera LookAt(const Vec3d& eye, const Vec3d& look_at, const Vec3d& up, double fov_x_rad,
                       int width, int height);
  // ortho_width: the world width of the picture, > 0.
  static Camera LookAtOrthographic(const Vec3d& eye, const Vec3d& look_at, const Vec3d& up,
                                   double ortho_width, int width, int height);

  // The same view on another number of pixels: intrinsics scaled per axis.
  Camera Resized(int new_width, int new_height) const;
  // The part of the picture that starts at pixel (x0, y0) and is w x h pixels large (a tile of it).
  Camera Cropped(int x0, int y0, int w, int h) const;

  // Pixel coordinates of a world point; false behind a perspective camera.
  SHERD_HD bool Project(const Vec3d& point_in_world, double* x_px, double* y_px) const {
    const Vec3d v = point_in_world - eye;
    double scale = 1.0;
    if (projection == Projection::kPerspective) {
      const double depth = Dot(v, forward);
      if (!(depth > 0)) return false;
      scale = 1.0 / depth;
    }
    *x_px = fx * Dot(v, right) * scale + cx;
    *y_px = fy * Dot(v, down) * scale + cy;
    return true;
  }
  // World length of one pixel at `depth` along the forward axis.
  SHERD_HD double PixelSizeAt(double depth) const {
    return projection == Projection::kOrthographic ? 1.0 / fx : depth / fx;
  }
};

struct RayD {
  Vec3d origin{}, direction{};  // direction of unit length
};

// The ray through image coordinates (x, y).
SHERD_HD RayD RayThrough(const Camera& camera, double x, double y) {
  const Vec3d offset =
      camera.right * ((x - camera.cx) / camera.fx) + camera.down * ((y - camera.cy) / camera.fy);
  if (camera.projection == Projection::kOrthographic) {
    return {camera.eye + offset, camera.forward};
  }
  return {camera.eye, Normalized(camera.forward + offset)};
}

}  // namespace sherd
