#include "reconstruction/surface_field.h"

#include <cmath>
#include <limits>

namespace sherd {

SurfaceField::Value SurfaceField::At(const Vec3f& p) const {
  Value out;
  const SupportIndex::Range range = index_.At(p);
  for (const std::uint32_t* i = range.begin; i != range.end; ++i) {
    const Vec3f d = p - cloud_.center[*i];
    const float r = cloud_.RadiusOf(*i);
    const float inverse = 1 / (r * r);
    const float x = 1 - Dot(d, d) * inverse;
    if (!(x > 0)) continue;
    out.field += x * x;
    out.gradient += d * (-4 * x * inverse);
  }
  return out;
}

float SurfaceField::SignedDistance(const Vec3f& p, const Vec3f& outward, float threshold,
                                   std::uint32_t anchor) const {
  constexpr int kNewtonSteps = 8;
  const float radius = cloud_.RadiusOf(anchor);
  const float tolerance = 1e-3f * radius;
  Vec3f q = p;
  bool inside = false;
  for (int step = 0; step < kNewtonSteps; ++step) {
    const Value value = At(q);
    if (step == 0) inside = value.field >= threshold;
    const float slope2 = Dot(value.gradient, value.gradient);
    if (!(value.field > 0)) break;
    // Towards the surface, a quarter of a radius at most: the field is no straight line.
    Vec3f move = slope2 > 0 ? value.gradient * ((threshold - value.field) / slope2)
                            : outward * (inside ? radius : -radius);
    const float length = Length(move);
    if (length < tolerance) return (inside ? -1.0f : 1.0f) * Length(q + move - p);
    if (length > 0.25f * radius) move = move * (0.25f * radius / length);
    q += move;
  }
  // Between the point and the anchor's centre, by halving, where one is inside and one is not.
  const Vec3f end = cloud_.center[anchor];
  if ((At(end).field >= threshold) == inside) return std::numeric_limits<float>::infinity();
  float low = 0, high = 1;
  for (int step = 0; step < 12; ++step) {
    const float middle = 0.5f * (low + high);
    ((At(p + (end - p) * middle).field >= threshold) == inside ? low : high) = middle;
  }
  return (inside ? -1.0f : 1.0f) * high * Length(end - p);
}

}  // namespace sherd
