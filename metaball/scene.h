// What is drawn: a cloud, the surface taken from its field, and how it is lit.
#pragma once

#include <memory>

#include "metaball/cloud.h"
#include "metaball/vec.h"

namespace sherd {

// F(p) = sum of the densities of all metaballs at p; the surface is F = threshold (thesis 2.8),
// the inside F >= threshold. The density is Murakami's (thesis 2.4).
struct Surface {
  double threshold = 0.7;     // > 0; at or above the highest field nothing is drawn
  double radius_scale = 1.0;  // > 0; multiplies every radius
};

// thesis 3.7: min(1, C * ambient + C * diffuse * max(0, n . l)).
struct Lighting {
  bool unlit = false;             // the blended colour itself
  double ambient = 0.35;          // >= 0
  double diffuse = 0.65;          // >= 0
  bool headlight = true;          // the light comes from the camera; to_light is not used
  Vec3d to_light{-0.5, 1, -0.6};  // towards the light, any length > 0
};

struct Scene {
  std::shared_ptr<const Cloud> cloud;
  Surface surface;
  Lighting lighting;
};

}  // namespace sherd
