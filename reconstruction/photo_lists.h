// Lists of photographs, one for each point, in one array (SurveyPoints::photo_begin, photo_idx).
// Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/survey.h"

namespace sherd {

// The points `order[0], order[1], ...` of `points`, all channels. Entries of `order` < size().
SurveyPoints Gather(const SurveyPoints& points, const std::vector<std::uint32_t>& order);

// The same in place, an array at a time: beside the points there is never a copy of more than one
// of their arrays.
void Rearrange(const std::vector<std::uint32_t>& order, SurveyPoints* points);

// The same of entries that ascend, without any copy.
void Keep(const std::vector<std::uint32_t>& kept, SurveyPoints* points);
template <class T>
void Keep(const std::vector<std::uint32_t>& kept, std::vector<T>* values) {
  if (values->empty()) return;
  for (std::size_t k = 0; k < kept.size(); ++k) (*values)[k] = (*values)[kept[k]];
  values->resize(kept.size());
}

// Adds `more` at the end of `points`, which has the same channels.
void Append(const SurveyPoints& more, SurveyPoints* points);

// Replaces every entry of photo_idx by photo_of[entry] where that is not `kNoPhoto`, and removes
// the others. Returns how many were removed.
inline constexpr std::uint32_t kNoPhoto = UINT32_MAX;
std::uint64_t RemapPhotos(const std::vector<std::uint32_t>& photo_of, SurveyPoints* points);

}  // namespace sherd
