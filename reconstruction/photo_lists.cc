#include "reconstruction/photo_lists.h"

namespace sherd {

SurveyPoints Gather(const SurveyPoints& points, const std::vector<std::uint32_t>& order) {
  SurveyPoints out;
  const auto gather = [&](const auto& from, auto* to) {
    if (from.empty()) return;
    to->reserve(order.size());
    for (const std::uint32_t i : order) to->push_back(from[i]);
  };
  gather(points.position, &out.position);
  gather(points.color, &out.color);
  gather(points.normal, &out.normal);
  gather(points.error, &out.error);
  if (!points.photo_begin.empty()) {
    out.photo_begin.reserve(order.size() + 1);
    out.photo_begin.push_back(0);
    std::uint64_t total = 0;
    for (const std::uint32_t i : order) total += points.photo_begin[i + 1] - points.photo_begin[i];
    out.photo_idx.reserve(total);
    for (const std::uint32_t i : order) {
      out.photo_idx.insert(out.photo_idx.end(), points.photo_idx.begin() + points.photo_begin[i],
                           points.photo_idx.begin() + points.photo_begin[i + 1]);
      out.photo_begin.push_back(out.photo_idx.size());
    }
  }
  return out;
}

void Append(const SurveyPoints& more, SurveyPoints* points) {
  const auto append = [](const auto& from, auto* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  append(more.position, &points->position);
  append(more.color, &points->color);
  append(more.normal, &points->normal);
  append(more.error, &points->error);
  for (std::size_t i = 1; i < more.photo_begin.size(); ++i) {
    points->photo_begin.push_back(points->photo_idx.size() + more.photo_begin[i]);
  }
  append(more.photo_idx, &points->photo_idx);
}

std::uint64_t RemapPhotos(const std::vector<std::uint32_t>& photo_of, SurveyPoints* points) {
  std::uint64_t write = 0, removed = 0;
  for (std::size_t i = 0; i + 1 < points->photo_begin.size(); ++i) {
    const std::uint64_t begin = points->photo_begin[i], end = points->photo_begin[i + 1];
    points->photo_begin[i] = write;
    for (std::uint64_t j = begin; j < end; ++j) {
      const std::uint32_t photo = photo_of[points->photo_idx[j]];
      if (photo == kNoPhoto) {
        ++removed;
      } else {
        points->photo_idx[write++] = photo;
      }
    }
  }
  if (!points->photo_begin.empty()) points->photo_begin.back() = write;
  points->photo_idx.resize(write);
  return removed;
}

}  // namespace sherd
