// The photographs of a survey as far as they can be looked up. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "metaball/photo/sampler.h"
#include "reconstruction/mask_distance.h"
#include "reconstruction/photo_store.h"
#include "reconstruction/photo_view.h"
#include "reconstruction/survey.h"

namespace sherd {

class PhotoSet {
 public:
  // max_bytes: of pixels held at any time, a sixteenth of it for masks where there are any.
  // leave_out: never looked up. The survey must outlive it.
  PhotoSet(const Survey& survey, std::size_t max_bytes,
           const std::vector<std::uint32_t>& leave_out);

  const Survey& survey() const { return survey_; }
  std::size_t size() const { return views_.size(); }

  // Reads the headers and the masks of the photographs that were not asked for before. One whose
  // mask cannot be read is used whole. Throws Cancelled.
  void Prepare(const std::vector<bool>& needed, const Control& control = {});
  // Null for one that is left out, cannot be read or was not prepared.
  const PhotoView* View(std::size_t photo) const {
    return photo < views_.size() && views_[photo] ? &*views_[photo] : nullptr;
  }

  // The weight that the mask of lookup.photo, which has a view, leaves a lookup at `point`: 0 where
  // SampleFootprint would look at a black pixel, growing to 1 over the width of its surroundings.
  // 1 without a mask.
  double Unmasked(const PhotoLookup& lookup, const Vec3d& point) const;

  // Calls visit(i, pyramid) once for every lookup whose photograph can be read, each photograph
  // decoded once, in parallel: two calls for one photograph may run at once. `what` is reported.
  void Visit(const std::vector<PhotoLookup>& lookups, const char* what,
             const std::function<void(std::size_t i, const PhotoPyramid& pyramid)>& visit,
             const Control& control);
  // Asks `sampler` for the colours of every lookup whose photograph can be read; there[i]: it
  // could. Photographs are decoded only where the sampler needs their pixels.
  void Sample(const std::vector<PhotoLookup>& lookups, const char* what, PhotoSampler* sampler,
              std::vector<PhotoColors>* colors, std::vector<char>* there, const Control& control);

  // Photographs that Visit and Sample have looked into since the last ClearUsed.
  std::uint64_t used() const;
  void ClearUsed() { used_.assign(views_.size(), false); }
  std::uint64_t unreadable() const;
  const std::vector<std::string>& problems() const { return problems_; }  // one line each
  // For whoever asked for the photographs: a line for those that cannot be used, one for the masks
  // that cannot be read; none where all can.
  std::vector<std::string> Warnings() const;

 private:
  // Lookups by photograph, of those that have a view.
  struct Group {
    std::uint32_t photo = 0;
    int finest = 0;                  // the finest level among them
    std::vector<std::uint32_t> idx;  // into the lookups
  };
  std::vector<Group> GroupsOf(const std::vector<PhotoLookup>& lookups) const;
  // Decodes the groups' photographs, as many at a time as fit, and calls visit(group, pyramid) for
  // each that can be read.
  void Decode(std::vector<Group> groups, const char* what,
              const std::function<void(const Group& group, const PhotoPyramid& pyramid)>& visit,
              const Control& control);

  const Survey& survey_;
  MaskDistances masks_;
  PhotoStore store_;
  std::vector<std::optional<PhotoView>> views_;
  std::vector<bool> tried_, left_out_, used_;
  std::vector<std::string> problems_;
};

}  // namespace sherd
