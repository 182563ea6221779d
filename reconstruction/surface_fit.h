// Puts the surface of a level onto the points it was made from. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/control.h"
#include "metaball/vec.h"
#include "reconstruction/downsample.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"

namespace sherd {

// A level's metaballs while they are made; n entries each, world units. `position` is the point of
// the surface that a metaball stands for; its centre lies `depth` below it, against its normal.
struct FittedMetaballs {
  std::vector<Vec3d> position;
  std::vector<Vec3f> normal;  // unit, outwards
  std::vector<double> depth;  // >= 0
  std::vector<double> radius;
  double median_spacing = 0;
  double open_share = 0;  // see LevelStats::open_share

  Vec3d CenterOf(std::size_t i) const { return position[i] - normal[i].cast<double>() * depth[i]; }
};

// The distances of all surveyed points that a surface is found for, where they were surveyed, to
// the surface, world units (SurfaceField says which way they are measured).
struct SurfaceErrors {
  double mean = 0, p95 = 0, largest = 0;
};

// position, normal: one metaball for each cell of `points`. Sinks the centres below the surface,
// as deep as a sheet's field stands above its metaballs but no farther than half way to a surface
// that looks the other way (a thin wall's back), chooses radii for where they then are, and moves
// them in a few sweeps until the surface field = threshold runs through the points of each cell in
// the mean. Deterministic. Throws Cancelled.
FittedMetaballs FitSurface(const SurveyPoints& points, const PointCells& cells,
                           std::vector<Vec3d> position, std::vector<Vec3f> normal,
                           double radius_factor, double threshold, const Control& control = {});

SurfaceErrors MeasureErrors(const PreparedPoints& prepared, const PointCells& cells,
                            const FittedMetaballs& metaballs, double threshold,
                            const Control& control = {});

}  // namespace sherd
