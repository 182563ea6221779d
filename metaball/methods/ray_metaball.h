// A metaball as one ray sees it, and the density of a scene: what the rival methods (in double) and
// the thesis's renderer are written in.
#pragma once

#include <cmath>
#include <cstdint>

#include "metaball/density/model.h"
#include "metaball/density/shapes.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// With s = (t - b) / R the distance from the closest approach in support radii, u = miss + s^2.
template <class Real>
struct BasicRayMetaball {
  Real b = 0;                // along the ray to the closest approach
  Real miss = 0;             // (perpendicular distance / support radius)^2, < 1
  Real inverse_radius = 0;   // of the support
  Real enter = 0, exit = 0;  // where the ray meets the support, enter < exit
  Real threshold = 0;        // its own, or the surface's; set by who takes it in
  std::uint32_t idx = 0;     // in the cloud

  SHERD_HD Real At(Real t) const {
    const Real s = (t - b) * inverse_radius;
    return miss + s * s;
  }
  // d u / d t.
  SHERD_HD Real RateAt(Real t) const { return 2 * (t - b) * inverse_radius * inverse_radius; }
};
using RayMetaball = BasicRayMetaball<double>;

// A scene's density over its support, by u.
struct MethodDensity {
  ResolvedDensity resolved;

  double Value(double u) const { return resolved.amplitude * ShapeValue(resolved.shape, u); }
  // d Value / d u.
  double Slope(double u) const { return resolved.amplitude * ShapeSlope(resolved.shape, u); }
};

// False when the ray misses the support or leaves it behind: the sphere test (thesis 2.11).
// to_center: centre minus the ray's origin.
template <class Real>
SHERD_HD bool MeetMetaball(const Vec3<Real>& to_center, const Vec3<Real>& direction,
                           Real support_radius, std::uint32_t idx, BasicRayMetaball<Real>* met) {
  met->b = Dot(to_center, direction);
  const Vec3<Real> across = to_center - direction * met->b;
  met->inverse_radius = 1 / support_radius;
  met->miss = Dot(across, across) * met->inverse_radius * met->inverse_radius;
  if (!(met->miss < 1)) return false;
  const Real half = SquareRoot(1 - met->miss) * support_radius;
  met->enter = met->b - half;
  met->exit = met->b + half;
  met->idx = idx;
  return met->exit > 0;
}

}  // namespace sherd
