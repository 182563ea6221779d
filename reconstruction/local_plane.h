// The plane through neighbouring points. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/vec.h"

namespace sherd {

struct LocalPlane {
  Vec3d normal{0, 0, 1};  // unit; its sign means nothing
  // The share of the points' variance that lies across the plane: 0 on a plane, 1/3 in a ball
  // (surface variation; Pauly, Gross and Kobbelt, "Efficient simplification of point-sampled
  // surfaces", 2002). 0 where all points coincide.
  double variation = 0;
  // Root mean square distance of the points from the plane, for the three numbers that were fitted
  // (divided by count - 3); 0 for fewer than four points.
  double deviation = 0;
};

// Of the points idx[0 .. count).
LocalPlane FitPlane(const std::vector<Vec3d>& positions, const int* idx, int count);

}  // namespace sherd
