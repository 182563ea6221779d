// Texture coordinates for clouds without any: planar, cylindrical, spherical and cubic projection
// (thesis algorithm 5, figure 3.10), taken at the surface point itself.
#pragma once

#include "metaball/cloud.h"
#include "metaball/vec.h"

namespace sherd {

enum class ProjectionKind {
  kPlanar,       // along `forward`: u to the right, v up
  kCylindrical,  // u around `up`, v along it
  kSpherical,    // u around `up`, v from the lower pole to the upper
  kCubic,        // onto the side of the box that is nearest, each side the whole image
};

struct TextureProjection {
  ProjectionKind kind = ProjectionKind::kPlanar;
  Vec3d center{};                                       // world
  Vec3d right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, 1};  // world, orthonormal
  Vec3d size{1, 1, 1};  // of the box along right, up and forward, world units; all > 0

  // Coordinates of a world point; the box is [0, 1] in u and v. Every finite point has some: the
  // axis of a cylinder and the centre of a sphere get u = 0.5.
  void At(const Vec3d& point, double* u, double* v) const;
  // Whether u meets itself after a turn.
  bool wraps_u() const {
    return kind == ProjectionKind::kCylindrical || kind == ProjectionKind::kSpherical;
  }
};

// The projection that fits a cloud's centres: the image's up is `up`, it is looked at along
// `forward` (made orthogonal to it). Axes without extent get the largest one's. Throws Error where
// up and forward are parallel or have no length.
TextureProjection FitProjection(const Cloud& cloud, ProjectionKind kind, const Vec3d& forward,
                                const Vec3d& up);

}  // namespace sherd
