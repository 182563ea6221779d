#include "metaball/appearance/projection.h"

#include <algorithm>
#include <cmath>

#include "metaball/error.h"

namespace sherd {

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
