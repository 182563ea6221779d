// Radii from local spacing. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/control.h"
#include "metaball/vec.h"

namespace sherd {

struct Radii {
  std::vector<double> radius;   // world units, > 0
  std::vector<double> spacing;  // local spacing of the metaballs themselves, world units, > 0
  double median_spacing = 0;
  double open_share = 0;  // see LevelStats::open_share
};

// For metaballs that stand for many points each; see radii.cc for how it was found.
extern const double kDefaultRadiusFactor;

// The default of LevelOptions::radius_factor for metaballs that stand for so many points each, in
// the mean (at least 1).
double DefaultRadiusFactor(double points_per_metaball);

Radii ComputeRadii(const std::vector<Vec3d>& positions, double radius_factor,
                   const Control& control = {});

}  // namespace sherd
