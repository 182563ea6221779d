// Where a photograph shows a place, on the CPU and on the GPU.
#pragma once

#include "metaball/hostdevice.h"
#include "metaball/photo/lens.h"
#include "metaball/vec.h"

namespace sherd {

// A photograph as the file that is looked up, with the camera it was taken by. The file may be a
// resize of what the camera describes, or an undistorted copy of the original.
struct PhotoCamera {
  bool usable = false;  // the others say nothing where not
  // Camera from world: a unit quaternion and a translation.
  double qw = 1, qx = 0, qy = 0, qz = 0;
  Vec3d translation{};
  Vec3d center{};                     // world
  double offset_u = 0, offset_v = 0;  // by which directions are shifted, tangents
  Lens lens;                          // of the file's camera
  double scale_x = 1, scale_y = 1;    // file pixels a pixel of that camera
  int width = 0, height = 0;          // of the file
  Lens original;                      // of the original, in whose pixels masks are
  double original_width = 0, original_height = 0;
  double original_px_per_px = 1;  // pixels of the original that one of the file is wide

  // Pixel coordinates in the file; false where the photograph does not show the point.
  SHERD_HD bool Project(const Vec3d& point_in_world, double* x, double* y) const {
    if (!lens.Project(InCamera(point_in_world), x, y)) return false;
    *x *= scale_x;
    *y *= scale_y;
    return *x >= 0 && *y >= 0 && *x <= width && *y <= height;
  }
  // The same in the original's pixels.
  SHERD_HD bool ProjectIntoOriginal(const Vec3d& point_in_world, double* x, double* y) const {
    return original.Project(InCamera(point_in_world), x, y) && *x >= 0 && *y >= 0 &&
           *x <= original_width && *y <= original_height;
  }

 private:
  SHERD_HD Vec3d InCamera(const Vec3d& point_in_world) const {
    // v + 2 q x (q x v + w v)
    const Vec3d q{qx, qy, qz};
    const Vec3d t = Cross(q, point_in_world) * 2.0;
    Vec3d p = point_in_world + t * qw + Cross(q, t) + translation;
    p.x += offset_u * p.z;
    p.y += offset_v * p.z;
    return p;
  }
};

}  // namespace sherd
