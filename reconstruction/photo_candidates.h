// The photographs that a picture may look into. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/camera.h"
#include "metaball/frame.h"
#include "reconstruction/photo_set.h"

namespace sherd {

// Those that are nearest by direction at the points of a grid over the picture, in ascending order;
// all where they are few. frame: with depth, normal and id planes. Depth maps are not asked.
std::vector<std::uint32_t> PhotoCandidates(const PhotoSet& photos, const Camera& camera,
                                           const Frame& frame);

}  // namespace sherd
