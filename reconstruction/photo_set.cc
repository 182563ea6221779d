#include "reconstruction/photo_set.h"

#include <algorithm>
#include <utility>

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

std::vector<PhotoSet::Group> PhotoSet::GroupsOf(const std::vector<PhotoLookup>& lookups) const {
  std::vector<std::size_t> count(views_.size(), 0);
  for (const PhotoLookup& lookup : lookups) ++count[lookup.photo];
  std::vector<Group> groups;
  std::vector<std::size_t> group_of(views_.size());
  for (std::size_t photo = 0; photo < views_.size(); ++photo) {
    if (count[photo] == 0 || !views_[photo]) continue;
    group_of[photo] = groups.size();
    groups.push_back({static_cast<std::uint32_t>(photo), 30, {}});
    groups.back().idx.reserve(count[photo]);
  }
  for (std::size_t i = 0; i < lookups.size(); ++i) {
    if (!views_[lookups[i].photo]) continue;
    Group& group = groups[group_of[lookups[i].photo]];
    group.finest = std::min<int>(group.finest, lookups[i].level);
    group.idx.push_back(static_cast<std::uint32_t>(i));
  }
  return groups;
}

void PhotoSet::Decode(
    std::vector<Group> groups, const char* what,
    const std::function<void(const Group& group, const PhotoPyramid& pyramid)>& visit,
    const Control& control) {
  const auto request_of = [&](const Group& group) {
    const PhotoView& view = *views_[group.photo];
    return PhotoStore::Request{view.path(), view.width(), view.height(), group.finest};
  };
  // First what is held already: the others may take its room.
  std::stable_partition(groups.begin(), groups.end(),
                        [&](const Group& group) { return store_.Holds(request_of(group)); });
  std::vector<PhotoStore::Request> requests;
  for (const Group& group : groups) requests.push_back(request_of(group));
  for (std::size_t r = 0; r < requests.size();) {
    control.Report(what, static_cast<double>(r) / static_cast<double>(requests.size()));
    for (const auto& pyramid : store_.Fetch(requests, r, control, &problems_)) {
      const Group& group = groups[r++];
      if (pyramid) {
        used_[group.photo] = true;
        visit(group, *pyramid);
      } else {
        views_[group.photo].reset();
      }
    }
  }
}

void PhotoSet::Visit(const std::vector<PhotoLookup>& lookups, const char* what,
                     const std::function<void(std::size_t i, const PhotoPyramid& pyramid)>& visit,
                     const Control& control) {
  constexpr std::size_t kBlock = 2048;
  Decode(
      GroupsOf(lookups), what,
      [&](const Group& group, const PhotoPyramid& pyramid) {
        ParallelBlocks(
            group.idx.size(), kBlock,
            [&](std::size_t from, std::size_t to) {
              for (std::size_t k = from; k < to; ++k) visit(group.idx[k], pyramid);
            },
            control);
      },
      control);
}

void PhotoSet::Sample(const std::vector<PhotoLookup>& lookups, const char* what,
                      PhotoSampler* sampler, std::vector<PhotoColors>* colors,
                      std::vector<char>* there, const Control& control) {
  colors->assign(lookups.size(), {});
  there->assign(lookups.size(), 0);
  std::vector<PhotoLookup> own;
  std::vector<PhotoColors> sampled;
  const auto gather = [&](const Group& group) {
    own.clear();
    for (const std::uint32_t i : group.idx) own.push_back(lookups[i]);
  };
  const auto sample = [&](const Group& group, const PhotoExtent& extent,
                          const PhotoPyramid* pyramid) {
    sampled.resize(own.size());
    sampler->Sample(extent, pyramid, own, sampled.data(), control);
    for (std::size_t k = 0; k < own.size(); ++k) {
      (*colors)[group.idx[k]] = sampled[k];
      (*there)[group.idx[k]] = 1;
    }
  };
  const auto extent_of = [&](const Group& group) {
    const PhotoView& view = *views_[group.photo];
    return PhotoExtent{group.photo, view.width(), view.height(), group.finest};
  };
  // First what the sampler still holds: the others may make it let go of that.
  std::vector<Group> rest;
  for (Group& group : GroupsOf(lookups)) {
    gather(group);
    if (sampler->NeedsPixels(extent_of(group), own, control)) {
      rest.push_back(std::move(group));
    } else {
      used_[group.photo] = true;
      sample(group, extent_of(group), nullptr);
    }
  }
  Decode(
      std::move(rest), what,
      [&](const Group& group, const PhotoPyramid& pyramid) {
        gather(group);
        sample(group, extent_of(group), &pyramid);
      },
      control);
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
