#include "reconstruction/photo_set.h"

#include <algorithm>
#include <numeric>

#include "metaball/error.h"
#include "reconstruction/parallel.h"

namespace sherd {

PhotoSet::PhotoSet(const Survey& survey, std::size_t max_bytes,
                   const std::vector<std::uint32_t>& leave_out)
    : survey_(survey),
      masks_(survey, max_bytes / 16),
      store_(max_bytes - masks_.max_bytes()),
      views_(survey.photographs.size()),
      tried_(survey.photographs.size(), false),
      left_out_(survey.photographs.size(), false),
      used_(survey.photographs.size(), false) {
  for (const std::uint32_t photo : leave_out) {
    if (photo >= left_out_.size()) {
      throw Error("there is no photograph " + std::to_string(photo) + " to leave out; there are " +
                  std::to_string(left_out_.size()));
    }
    left_out_[photo] = true;
  }
}

void PhotoSet::Prepare(const std::vector<bool>& needed, const Control& control) {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    if (!needed[i] || tried_[i] || left_out_[i]) continue;
    tried_[i] = true;
    try {
      views_[i].emplace(survey_, i);
    } catch (const InputError& error) {
      problems_.push_back(error.what());
    }
  }
  std::vector<bool> shown(views_.size());
  for (std::size_t i = 0; i < views_.size(); ++i) shown[i] = needed[i] && views_[i];
  masks_.Read(shown, control);
}

double PhotoSet::Unmasked(const PhotoLookup& lookup, const Vec3d& point) const {
  const MaskDistance* const mask = masks_.Of(lookup.photo);
  if (!mask) return 1;
  const PhotoView& view = *views_[lookup.photo];
  double x, y;
  if (!view.ProjectIntoOriginal(point, &x, &y)) return 0;
  const double distance = mask->At(x, y) / view.original_px_per_px();
  return std::clamp((distance - FootprintReach(lookup)) / SurroundingsWidth(lookup), 0.0, 1.0);
}

void PhotoSet::Visit(const std::vector<PhotoLookup>& lookups, const char* what,
                     const std::function<void(std::size_t i, const PhotoPyramid& pyramid)>& visit,
                     const Control& control) {
  constexpr std::size_t kBlock = 2048;
  // By photograph (a counting sort).
  std::vector<std::size_t> begin(views_.size() + 1, 0);
  for (const PhotoLookup& lookup : lookups) ++begin[std::size_t{lookup.photo} + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> order(lookups.size());
  std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t i = 0; i < lookups.size(); ++i) {
    order[next[lookups[i].photo]++] = static_cast<std::uint32_t>(i);
  }
  std::vector<PhotoStore::Request> requests;
  std::vector<std::size_t> photo_of;
  for (std::size_t photo = 0; photo < views_.size(); ++photo) {
    if (begin[photo] == begin[photo + 1] || !views_[photo]) continue;
    int finest = 30;
    for (std::size_t i = begin[photo]; i < begin[photo + 1]; ++i) {
      finest = std::min<int>(finest, lookups[order[i]].level);
    }
    const PhotoView& view = *views_[photo];
    requests.push_back({view.path(), view.width(), view.height(), finest});
    photo_of.push_back(photo);
  }
  for (std::size_t r = 0; r < requests.size();) {
    control.Report(what, static_cast<double>(r) / static_cast<double>(requests.size()));
    const auto pyramids = store_.Fetch(requests, r, control, &problems_);
    for (const auto& pyramid : pyramids) {
      const std::size_t photo = photo_of[r++];
      if (!pyramid) {
        views_[photo].reset();
        continue;
      }
      used_[photo] = true;
      const std::size_t first = begin[photo];
      ParallelBlocks(
          begin[photo + 1] - first, kBlock,
          [&](std::size_t from, std::size_t to) {
            for (std::size_t i = from; i < to; ++i) visit(order[first + i], *pyramid);
          },
          control);
    }
  }
}

std::uint64_t PhotoSet::used() const {
  return static_cast<std::uint64_t>(std::count(used_.begin(), used_.end(), true));
}

std::uint64_t PhotoSet::unreadable() const {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < views_.size(); ++i) count += tried_[i] && !views_[i];
  return count;
}

std::vector<std::string> PhotoSet::Warnings() const {
  std::vector<std::string> warnings;
  const std::size_t count = problems_.size();
  if (count > 0) {
    warnings.push_back(std::to_string(count) + (count == 1 ? " photograph" : " photographs") +
                       " could not be used: " + problems_.front() +
                       (count > 1 ? " (and others)" : ""));
  }
  const std::string masks = masks_.Warning();
  if (!masks.empty()) warnings.push_back(masks);
  return warnings;
}

}  // namespace sherd
