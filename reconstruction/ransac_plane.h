// Planes by PCL's RANSAC. Internal to reconstruction/; no PCL type shows.
#pragma once

#include <optional>
#include <vector>

#include "metaball/vec.h"

namespace sherd {

struct FoundPlane {
  Vec3f normal{};    // unit; its sign means nothing
  float offset = 0;  // Dot(normal, p) + offset = 0 on the plane
};

// The plane with most of `points` within `tolerance` among those whose normal is within
// `angle_rad` of +-`axis` (no axis: among all). Deterministic. nullopt where no three points make
// one. Finds a plane of a tenth of the points in 99.9 % of all cases.
std::optional<FoundPlane> RansacPlane(const std::vector<Vec3f>& points, double tolerance,
                                      const std::optional<Vec3f>& axis, double angle_rad);

}  // namespace sherd
