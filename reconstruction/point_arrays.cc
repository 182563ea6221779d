#include "reconstruction/point_arrays.h"

#include <utility>

namespace sherd {
namespace {

struct Lists {
  std::vector<std::uint64_t> begin;
  std::vector<std::uint32_t> idx;
};

Lists GatheredLists(const SurveyPoints& points, const std::vector<std::uint32_t>& order) {
  Lists out;
  if (points.photo_begin.empty()) return out;
  out.begin.reserve(order.size() + 1);
  out.begin.push_back(0);
  std::uint64_t total = 0;
  for (const std::uint32_t i : order) total += points.photo_begin[i + 1] - points.photo_begin[i];
  out.idx.reserve(total);
  for (const std::uint32_t i : order) {
    const auto all = points.photo_idx.begin();
    out.idx.insert(out.idx.end(), all + static_cast<std::ptrdiff_t>(points.photo_begin[i]),
                   all + static_cast<std::ptrdiff_t>(points.photo_begin[i + 1]));
    out.begin.push_back(out.idx.size());
  }
  return out;
}

}  // namespace

SurveyPoints Gather(const SurveyPoints& points, const std::vector<std::uint32_t>& order) {
  Lists lists = GatheredLists(points, order);
  return {Gather(points.position, order), Gather(points.color, order), Gather(points.normal, order),
          Gather(points.error, order),    std::move(lists.begin),      std::move(lists.idx)};
}

void Rearrange(const std::vector<std::uint32_t>& order, SurveyPoints* points) {
  points->position = Gather(points->position, order);
  points->color = Gather(points->color, order);
  points->normal = Gather(points->normal, order);
  points->error = Gather(points->error, order);
  Lists lists = GatheredLists(*points, order);
  points->photo_begin = std::move(lists.begin);
  points->photo_idx = std::move(lists.idx);
}

void Keep(const std::vector<std::uint32_t>& kept, SurveyPoints* points) {
  Keep(kept, &points->position);
  Keep(kept, &points->color);
  Keep(kept, &points->normal);
  Keep(kept, &points->error);
  if (points->photo_begin.empty()) return;
  std::vector<std::uint64_t>& begin = points->photo_begin;
  std::uint64_t write = 0;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const std::uint64_t from = begin[kept[k]], to = begin[kept[k] + 1];
    begin[k] = write;
    for (std::uint64_t j = from; j < to; ++j) points->photo_idx[write++] = points->photo_idx[j];
  }
  begin.resize(kept.size() + 1);
  begin.back() = write;
  points->photo_idx.resize(write);
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
