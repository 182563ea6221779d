// The surface a rival method searches: a density, and how thresholds make a surface of it.
#pragma once

#include "metaball/methods/ray_metaball.h"
#include "metaball/scene.h"

namespace sherd {

struct MethodSurface {
  MethodDensity density;
  ThresholdMode mode = ThresholdMode::kUniform;
  double threshold = 0.0;  // the surface's own
  double lowest = 0.0;     // of the thresholds that count
};

MethodSurface MethodSurfaceOf(const Scene& scene);

}  // namespace sherd
