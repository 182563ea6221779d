// The shapes of the densities (model.h) and their bounds along a ray, for plain numbers.
//
// The formulas stand in the files ending in -inl.h, one a shape: Value, Slope (its derivative by
// u), bounds of the second derivative along a ray and of the slope. These files have no guard and
// open no namespace: they are included here for float and double, on the host and the device, and
// once for each instruction set by the packet tracer, there for vectors of rays.
//
// To add a density: a formula file, a kind in model.h, a line in ResolveDensity and one in
// WithShape.
#pragma once

#include "metaball/density/model.h"
#include "metaball/density/scalar_math.h"

#define SHERD_FORMULA SHERD_HD
#define SHERD_FORMULA_LAMBDA

namespace sherd {
#include "metaball/density/formulas-inl.h"
}  // namespace sherd

#undef SHERD_FORMULA
#undef SHERD_FORMULA_LAMBDA

namespace sherd {

// The shape at u = (distance / support radius)^2, any u >= 0; 0 from 1 on.
template <class T>
SHERD_HD T ShapeValue(const DensityShape& shape, T u) {
  if (!(u < T(1))) return T(0);
  return WithShape(shape, [u](const auto& s) { return s.Value(u); });
}
// Its derivative by u.
template <class T>
SHERD_HD T ShapeSlope(const DensityShape& shape, T u) {
  if (!(u < T(1))) return T(0);
  return WithShape(shape, [u](const auto& s) { return s.Slope(u); });
}

// Where a ray passes a metaball: in radii of the support, along the ray from its origin to the
// closest approach (b) and that point's squared distance from the centre (across2), which is >= 1
// when the ray misses the support.
template <class T>
struct RayPass {
  T b, across2;
};

// to_center: centre minus the ray's origin; direction of unit length.
template <class T, class V>
SHERD_HD RayPass<T> PassOf(const V& to_center, const V& direction, T inverse_radius) {
  const T along = to_center.x * direction.x + to_center.y * direction.y + to_center.z * direction.z;
  const T px = to_center.x - along * direction.x;
  const T py = to_center.y - along * direction.y;
  const T pz = to_center.z - along * direction.z;
  return {along * inverse_radius,
          (px * px + py * py + pz * pz) * (inverse_radius * inverse_radius)};
}

}  // namespace sherd
