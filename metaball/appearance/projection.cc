#include "metaball/appearance/projection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "metaball/error.h"

namespace sherd {

void TextureProjection::At(const Vec3d& point, double* u, double* v) const {
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

TextureProjection FitProjection(const Cloud& cloud, ProjectionKind kind, const Vec3d& forward,
                                const Vec3d& up) {
  TextureProjection projection;
  projection.kind = kind;
  const Vec3d right = Cross(forward, up);
  if (!(Length(right) > 1e-9 * Length(forward) * Length(up)) || !IsFinite(right)) {
    throw Error("a projection needs two directions that are not parallel");
  }
  projection.up = Normalized(up);
  projection.right = Normalized(right);
  projection.forward = Cross(projection.up, projection.right);
  Vec3d lo{INFINITY, INFINITY, INFINITY}, hi{-INFINITY, -INFINITY, -INFINITY};
  for (const Vec3f& local : cloud.center) {
    const Vec3d p = cloud.frame.unit * local.cast<double>();
    const Vec3d q{Dot(p, projection.right), Dot(p, projection.up), Dot(p, projection.forward)};
    lo = {std::min(lo.x, q.x), std::min(lo.y, q.y), std::min(lo.z, q.z)};
    hi = {std::max(hi.x, q.x), std::max(hi.y, q.y), std::max(hi.z, q.z)};
  }
  if (cloud.empty()) return projection;
  const Vec3d middle = (lo + hi) * 0.5;
  projection.center = cloud.frame.origin + projection.right * middle.x + projection.up * middle.y +
                      projection.forward * middle.z;
  const Vec3d size = hi - lo;
  const double largest = std::max({size.x, size.y, size.z});
  const auto extent = [&](double v) {
    return v > 1e-9 * largest ? v : largest > 0 ? largest : 1.0;
  };
  projection.size = {extent(size.x), extent(size.y), extent(size.z)};
  return projection;
}

}  // namespace sherd
