// A metaball as one ray sees it, and the density of a scene, in double: what the rival methods and
// the thesis's renderer are written in.
#pragma once

#include <cmath>
#include <cstdint>

#include "metaball/density/model.h"
#include "metaball/density/shapes.h"
#include "metaball/vec.h"

namespace sherd {

// With s = (t - b) / R the distance from the closest approach in support radii, u = miss + s^2.
struct RayMetaball {
  double b = 0.0;               // along the ray to the closest approach
  double miss = 0.0;            // (perpendicular distance / support radius)^2, < 1
  double inverse_radius = 0.0;  // of the support
  double enter = 0, exit = 0;   // where the ray meets the support, enter < exit
  double threshold = 0;         // its own, or the surface's; set by who takes it in
  std::uint32_t idx = 0;        // in the cloud

  double At(double t) const {
    const double s = (t - b) * inverse_radius;
    return miss + s * s;
  }
  // d u / d t.
  double RateAt(double t) const { return 2 * (t - b) * inverse_radius * inverse_radius; }
};

// A scene's density over its support, by u.
struct MethodDensity {
  ResolvedDensity resolved;

  double Value(double u) const { return resolved.amplitude * ShapeValue(resolved.shape, u); }
  // d Value / d u.
  double Slope(double u) const { return resolved.amplitude * ShapeSlope(resolved.shape, u); }
};

// False when the ray misses the support or leaves it behind: the sphere test (thesis 2.11).
// to_center: centre minus the ray's origin.
inline bool MeetMetaball(const Vec3d& to_center, const Vec3d& direction, double support_radius,
                         std::uint32_t idx, RayMetaball* met) {
  met->b = Dot(to_center, direction);
  const Vec3d across = to_center - direction * met->b;
  met->inverse_radius = 1 / support_radius;
  met->miss = Dot(across, across) * met->inverse_radius * met->inverse_radius;
  if (!(met->miss < 1)) return false;
  const double half = std::sqrt(1 - met->miss) * support_radius;
  met->enter = met->b - half;
  met->exit = met->b + half;
  met->idx = idx;
  return met->exit > 0;
}

}  // namespace sherd
