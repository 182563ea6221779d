// Texture coordinates for clouds without any: planar, cylindrical, spherical and cubic projection
// (thesis algorithm 5, figure 3.10), taken at the surface point itself.
#pragma once

#include <cmath>
#include <numbers>

#include "metaball/cloud.h"
#include "metaball/hostdevice.h"
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
  SHERD_HD void At(const Vec3d& point, double* u, double* v) const {
    const Vec3d offset = point - center;
    const double x = Dot(offset, right) / size.x;
    const double y = Dot(offset, up) / size.y;
    const double z = Dot(offset, forward) / size.z;
    constexpr double kTurn = 2 * std::numbers::pi;
    switch (kind) {
      case ProjectionKind::kPlanar:
        *u = x + 0.5;
        *v = y + 0.5;
        return;
      case ProjectionKind::kCylindrical:
      case ProjectionKind::kSpherical: {
        // Angles are those of the world, not of the box; the viewer who looks along `forward` sees
        // the image's middle upright in front of them, its right half to the right.
        const double east = Dot(offset, right), north = Dot(offset, up);
        const double towards = -Dot(offset, forward);
        const double around = std::hypot(east, towards);
        *u = (around > 0 ? std::atan2(east, towards) / kTurn : 0.0) + 0.5;
        *v = kind == ProjectionKind::kCylindrical
                 ? y + 0.5
                 : (around > 0 || north != 0 ? std::atan2(north, around) / std::numbers::pi : 0.0) +
                       0.5;
        return;
      }
      case ProjectionKind::kCubic: {
        const double ax = std::abs(x), ay = std::abs(y), az = std::abs(z);
        // Upright on the four sides; on the upper and the lower side `forward` is the image's up.
        if (ay > ax && ay > az) {
          *u = x + 0.5;
          *v = (y > 0 ? z : -z) + 0.5;
        } else if (ax > az) {
          *u = (x > 0 ? z : -z) + 0.5;
          *v = y + 0.5;
        } else {
          *u = (z > 0 ? -x : x) + 0.5;
          *v = y + 0.5;
        }
        return;
      }
    }
  }
  // Whether u meets itself after a turn.
  SHERD_HD bool wraps_u() const {
    return kind == ProjectionKind::kCylindrical || kind == ProjectionKind::kSpherical;
  }
};

// The projection that fits a cloud's centres: the image's up is `up`, it is looked at along
// `forward` (made orthogonal to it). Axes without extent get the largest one's. Throws Error where
// up and forward are parallel or have no length.
TextureProjection FitProjection(const Cloud& cloud, ProjectionKind kind, const Vec3d& forward,
                                const Vec3d& up);

}  // namespace sherd
