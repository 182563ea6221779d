// Which scenes floats cannot carry. Tiles that they cannot, because too many metaballs overlap, are
// found while they are traced (kFloatOverlap in tile_march.h).
#pragma once

#include <algorithm>
#include <cmath>

#include "metaball/cloud.h"
#include "metaball/scene.h"
#include "metaball/tile_march.h"

namespace sherd {

// Radii too far apart (kFloatRadiusRange). O(n).
inline bool HasWideRadii(const Cloud& cloud) {
  if (cloud.radius.empty()) return false;
  const auto [lo, hi] = std::minmax_element(cloud.radius.begin(), cloud.radius.end());
  return *hi > kFloatRadiusRange * *lo;
}

// A threshold so near one metaball's highest value that 2^-24 of it is much of what is left.
inline bool HasStiffThreshold(const Surface& surface) {
  return std::abs(surface.threshold / PeakOf(surface.density) - 1) < 1e-3;
}

}  // namespace sherd
