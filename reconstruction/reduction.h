// The points of a survey reduced to a target count, in one of several ways. Internal to
// reconstruction/.
#pragma once

#include "metaball/control.h"
#include "reconstruction/downsample.h"
#include "reconstruction/level.h"

namespace sherd {

// kVoxel: GroupPoints. kBlueNoise, kAdaptive: the most crowded candidates are eliminated
// (sample_elimination.h) until as many as wanted are left; each point belongs to the one nearest to
// it, or its candidate. Candidates are the cells of a grid, four times as many as are wanted, or
// all points where these are fewer. kAdaptive wants spacings proportional to 1 / sqrt(curvature),
// within a factor of two either way: the distance between a curved surface and a flat piece of it
// grows with curvature times spacing squared, so every metaball then misses by the same.
//
// nested: the first of points.order, each with the points nearest to it. Deterministic. Throws
// Cancelled, InputError (nested without an order).
PointCells ReducePoints(const PreparedPoints& points, const LevelOptions& options,
                        const Control& control = {});

}  // namespace sherd
