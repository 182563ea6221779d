// What a renderer does beyond a single frame, on a backend, against the CPU: a cloud that changes
// between frames, pictures in parts, several renderers on one picture, levels of detail.
#pragma once

#include <string>
#include <vector>

#include "appearance_scenes.h"
#include "feature_check.h"

namespace sherd {

// Which checks are made: those whose name holds the text.
using CheckFilter = std::string;

// One renderer over a cloud whose positions, radii, thresholds, colours and channel change from
// frame to frame, once plain with planes and once lit, with shadows and ambient occlusion. Each
// change must show. "moving_cloud_..." and "moving_lit_cloud_...".
std::vector<FeatureCheck> CheckMovingClouds(const std::string& backend, const CheckFilter& filter);

// The features by a renderer that has too little memory to draw them at once. "in_parts_...".
// Nothing where the backend cannot be told: the host loop alone can.
std::vector<FeatureCheck> CheckParts(const std::vector<FeatureScene>& features,
                                     const std::string& backend, const CheckFilter& filter);

// The features by renderers that share the picture: those of all GPUs that can be used, or several
// of one; the second picture of the same renderers, whose bands are other ones, in the first one's
// memory. "shared_...".
std::vector<FeatureCheck> CheckSharing(const std::vector<FeatureScene>& features,
                                       const std::string& backend, const CheckFilter& filter);

// Metaballs far smaller than a pixel through MakeLodRenderer over the backend.
// "level_of_detail_...".
std::vector<FeatureCheck> CheckLevelsOfDetail(const std::string& backend,
                                              const CheckFilter& filter);

}  // namespace sherd
