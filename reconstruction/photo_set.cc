#include "reconstruction/photo_set.h"

#include <algorithm>
#include <utility>

#include "metaball/error.h"
#include "metaball/stopwatch.h"
#include "reconstruction/parallel.h"

namespace sherd {

PhotoSet::PhotoSet(const Survey& survey, std::size_t max_bytes,
                   const std::vector<std::uint32_t>& leave_out)
    : survey_(survey),
      masks_(survey, max_bytes / 16),
      store_(max_bytes - masks_.max_bytes()),
      views_(survey.photographs.size()),
      cameras_(survey.photographs.size()),
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
      cameras_[i] = views_[i]->camera();
    } catch (const InputError& error) {
      problems_.push_back(error.what());
    }
  }
  std::vector<bool> shown(views_.size());
  for (std::size_t i = 0; i < views_.size(); ++i) shown[i] = needed[i] && views_[i];
  masks_.Read(shown, control);
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const MaskDistance* const mask = masks_.Of(i);
    if (!mask) continue;
    if (masks_of_.empty()) masks_of_.resize(views_.size());
    masks_of_[i] = mask->view();
  }
}

void PhotoSet::Decode(std::span<const PhotoRequest> requests, const char* what,
                      const std::function<void(std::size_t i, const PhotoPyramid* pyramid)>& visit,
                      const Control& control) {
  std::vector<PhotoStore::Request> files;
  for (const PhotoRequest& request : requests) {
    const PhotoView& view = *views_[request.photo];
    files.push_back({view.path(), view.width(), view.height(), request.finest});
  }
  // First what is held already: the others may take its room.
  std::vector<std::size_t> order(requests.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_partition(order.begin(), order.end(),
                        [&](std::size_t i) { return store_.Holds(files[i]); });
  std::vector<PhotoStore::Request> ordered;
  for (const std::size_t i : order) ordered.push_back(files[i]);
  for (std::size_t r = 0; r < ordered.size();) {
    control.Report(what, static_cast<double>(r) / static_cast<double>(ordered.size()));
    const Stopwatch decoding;
    const auto pyramids = store_.Fetch(ordered, r, control, &problems_);
    seconds_decoding_ += decoding.Seconds();
    for (const auto& pyramid : pyramids) {
      const std::size_t i = order[r++];
      const std::uint32_t photo = requests[i].photo;
      if (pyramid) {
        used_[photo] = true;
      } else {
        views_[photo].reset();
        cameras_[photo].usable = false;
      }
      visit(i, pyramid.get());
    }
  }
}

void PhotoSet::Visit(const std::vector<PhotoLookup>& lookups, const char* what,
                     const std::function<void(std::size_t i, const PhotoPyramid& pyramid)>& visit,
                     const Control& control) {
  constexpr std::size_t kBlock = 2048;
  constexpr std::size_t kNone = ~std::size_t{0};
  std::vector<PhotoRequest> requests;
  std::vector<std::vector<std::uint32_t>> idx;  // into the lookups, by request
  std::vector<std::size_t> request_of(views_.size(), kNone);
  for (std::size_t i = 0; i < lookups.size(); ++i) {
    const PhotoLookup& lookup = lookups[i];
    if (!views_[lookup.photo]) continue;
    std::size_t& at = request_of[lookup.photo];
    if (at == kNone) {
      at = requests.size();
      requests.push_back({lookup.photo, lookup.level});
      idx.emplace_back();
    }
    requests[at].finest = std::min<int>(requests[at].finest, lookup.level);
    idx[at].push_back(static_cast<std::uint32_t>(i));
  }
  Decode(
      requests, what,
      [&](std::size_t r, const PhotoPyramid* pyramid) {
        if (!pyramid) return;
        ParallelBlocks(
            idx[r].size(), kBlock,
            [&](std::size_t from, std::size_t to) {
              for (std::size_t k = from; k < to; ++k) visit(idx[r][k], *pyramid);
            },
            control);
      },
      control);
}

void PhotoSet::Fetch(std::span<const PhotoRequest> requests,
                     const std::function<void(std::size_t i, const PhotoPyramid* pyramid)>& visit,
                     const Control& control) {
  std::vector<PhotoRequest> known;
  std::vector<std::size_t> at;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    if (views_[requests[i].photo]) {
      known.push_back(requests[i]);
      at.push_back(i);
    } else {
      visit(i, nullptr);
    }
  }
  Decode(
      known, "projecting the photographs",
      [&](std::size_t k, const PhotoPyramid* pyramid) { visit(at[k], pyramid); }, control);
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
