// Points taken out of others, put into another order and joined, with all that is known of them,
// their lists of photographs included. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/survey.h"

namespace sherd {

// The points `order[0], order[1], ...` of `points`, all channels. Entries of `order` < size().
SurveyPoints Gather(const SurveyPoints& points, const std::vector<std::uint32_t>& order);
// Of an array that may be absent: empty, whatever the order.
template <class T>
std::vector<T> Gather(const std::vector<T>& values, const std::vector<std::uint32_t>& order) {
  std::vector<T> out;
  if (values.empty()) return out;
  out.reserve(order.size());
  for (const std::uint32_t i : order) out.push_back(values[i]);
  return out;
}

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
