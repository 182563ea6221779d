// The double-precision reference: slow, simple, trusted; everything is measured against it.
//
// It works in another way than the renderers: every metaball is tried against every ray (in blocks
// of pixels, after a test with a cone around the block that errs on the safe side), densities are
// evaluated in double, and the first crossing is isolated by interval arithmetic with bisection
// from the near end: an interval is passed over only when the field's upper bound on it lies below
// the threshold (natural bound and mean-value form, whichever is tighter).
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/camera.h"
#include "metaball/control.h"
#include "metaball/scene.h"

namespace sherd {

struct ReferenceHit {
  bool hit = false;
  // The field comes within kReferenceGrazing of the threshold before the hit (or without one):
  // programs with rounding may rightly differ here.
  bool grazing = false;
  double depth = 0.0;            // local units along the ray; 0 when the ray starts inside
  double smallest_radius = 0.0;  // of the supports that hold the hit, local units
  Vec3d normal{};                // unit, towards the outside
  Vec3d color{};                 // blended and lit, linear
  std::int32_t id = -1;          // the metaball with the largest density
};

// Relative to the threshold.
inline constexpr double kReferenceGrazing = 1e-6;

// The sum of the densities at a point in local units, over every metaball in order.
double ReferenceField(const Scene& scene, const Vec3d& point_in_local);

// The first crossing along a ray in local units.
ReferenceHit ReferenceTrace(const Scene& scene, const RayD& local_ray);

struct ReferenceFrame {
  int width = 0, height = 0;
  std::vector<ReferenceHit> pixels;  // row-major
};
// Every pixel of a picture. Throws Cancelled.
ReferenceFrame ReferenceRender(const Scene& scene, const Camera& camera, int threads = 0,
                               const Control& control = {});

}  // namespace sherd
