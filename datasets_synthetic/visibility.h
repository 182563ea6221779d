// Which photographs see a place of the surface.
#pragma once

#include <cstdint>
#include <vector>

#include "datasets_synthetic/scene.h"
#include "datasets_synthetic/shots.h"

namespace sherd::synthetic {

struct Sighting {
  std::size_t shot_idx = 0;
  double x = 0, y = 0;          // image coordinates in the photograph
  double pixels_per_metre = 0;  // on the surface, across the direction of view, times the cosine
};

// All photographs that see the point: in the picture by `margin_px`, not hidden, and on a surface
// that is turned towards them. `normal`: unit, towards the open side.
std::vector<Sighting> FindSightings(const TrenchScene& scene, const ShotPlan& plan,
                                    const std::vector<Lens>& lenses, const Vec3d& point,
                                    const Vec3d& normal, double margin_px);

}  // namespace sherd::synthetic
