// How high a cloud's surface stands above its metaballs.
#pragma once

#include "metaball/cloud.h"
#include "metaball/scene.h"

namespace sherd {

// The median distance from a metaball's centre to the surface nearest to it, in radii of its
// support, over at most 64 metaballs spread evenly in memory; the distance at which one alone falls
// to the threshold where the surface is too far away from all of them. For uniform thresholds and a
// density that is nowhere negative. O(n).
double MeasureSurfaceOffset(const Cloud& cloud, const Surface& surface, int threads = 0);

}  // namespace sherd
