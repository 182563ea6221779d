// Lists of photographs, one for each point, in one array (SurveyPoints::photo_begin, photo_idx).
// Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/survey.h"

namespace sherd {

// The points `order[0], order[1], ...` of `points`, all channels. Entries of `order` < size().
SurveyPoints Gather(const SurveyPoints& points, const std::vector<std::uint32_t>& order);

// Adds `more` at the end of `points`, which has the same channels.
void Append(const SurveyPoints& more, SurveyPoints* points);

// Replaces every entry of photo_idx by photo_of[entry] where that is not `kNoPhoto`, and removes
// the others. Returns how many were removed.
inline constexpr std::uint32_t kNoPhoto = UINT32_MAX;
std::uint64_t RemapPhotos(const std::vector<std::uint32_t>& photo_of, SurveyPoints* points);

}  // namespace sherd
