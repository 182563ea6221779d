// Murakami's density (thesis 2.4) and its bounds along a ray.
//
// With x = distance / radius and q = 1 - x^2, a metaball's density is f = q^2 where q > 0 and 0
// elsewhere. Along a ray, with s the distance from the point of closest approach in radii,
// q(s) = h - s^2 is a parabola, h = 1 - (perpendicular distance / radius)^2.
//
// The bound everything rests on: on a segment [s0, s1] the parabola has the Bernstein coefficients
//     q0 = h - s0^2,  q1 = h - s0 s1,  q2 = h - s1^2.
// Clamped at zero, Qi = max(qi, 0), they give a polynomial Q with Q >= 0 and Q - q >= 0 (all its
// coefficients are non-negative), so Q^2 >= f on the whole segment, also where the support begins
// or ends inside it; Q^2 = f at both ends of the segment, and everywhere if no qi was negative.
#pragma once

#include "metaball/hostdevice.h"

namespace sherd {

struct Murakami {
  // The highest value one metaball reaches, at its centre.
  static constexpr float kMaximum = 1.0f;
  // Degree of the bound along a ray.
  static constexpr int kDegree = 4;

  // Density for q = 1 - (d/r)^2, any real q.
  template <class T>
  static SHERD_HD T Value(T q) {
    return q > T(0) ? q * q : T(0);
  }
  // d f / d q.
  template <class T>
  static SHERD_HD T Derivative(T q) {
    return q > T(0) ? T(2) * q : T(0);
  }
};

// Bernstein coefficients on a segment of an upper bound of a sum of densities; c[0] and c[4] are
// the field's values at the two ends.
template <class T>
struct FieldBound {
  T c[Murakami::kDegree + 1] = {T(0), T(0), T(0), T(0), T(0)};

  // Adds one metaball: the segment runs from s0 to s1 (radii from its closest approach), h as
  // above.
  SHERD_HD void Add(T s0, T s1, T h) {
    const T q0 = h - s0 * s0;
    const T q1 = h - s0 * s1;
    const T q2 = h - s1 * s1;
    const T a = q0 > T(0) ? q0 : T(0);
    const T b = q1 > T(0) ? q1 : T(0);
    const T d = q2 > T(0) ? q2 : T(0);
    c[0] += a * a;
    c[1] += a * b;
    c[2] += (a * d + T(2) * b * b) * T(1.0 / 3.0);
    c[3] += b * d;
    c[4] += d * d;
  }
};

// Where a ray passes a metaball: in radii, along the ray from its origin to the closest approach
// (b) and h = 1 - (perpendicular distance)^2, which is <= 0 when the ray misses the support.
template <class T>
struct RayPass {
  T b, h;
};

// to_center: centre minus the ray's origin; direction of unit length.
template <class T, class V>
SHERD_HD RayPass<T> PassOf(const V& to_center, const V& direction, T inverse_radius) {
  const T along = to_center.x * direction.x + to_center.y * direction.y + to_center.z * direction.z;
  const T px = to_center.x - along * direction.x;
  const T py = to_center.y - along * direction.y;
  const T pz = to_center.z - along * direction.z;
  const T p = (px * px + py * py + pz * pz) * (inverse_radius * inverse_radius);
  return {along * inverse_radius, T(1) - p};
}

}  // namespace sherd
