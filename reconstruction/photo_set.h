// The photographs of a survey as far as they can be looked up. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "metaball/photo/photo_choice.h"
#include "metaball/photo/photo_shader.h"
#include "reconstruction/mask_distance.h"
#include "reconstruction/photo_store.h"
#include "reconstruction/photo_view.h"
#include "reconstruction/survey.h"

namespace sherd {

class PhotoSet final : public PhotoPixels {
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

  // The photographs as they are chosen from, those of `candidates`, which must live on as the
  // sights must. Valid until the next Prepare, Visit or Fetch.
  PhotosView ViewOf(std::span<const SightMap> sights,
                    std::span<const std::uint32_t> candidates) const {
    return {cameras_.data(), sights.data(), masks_of_.empty() ? nullptr : masks_of_.data(),
            candidates.data(), static_cast<std::uint32_t>(candidates.size())};
  }
  std::span<const PhotoCamera> cameras() const { return cameras_; }
  std::span<const MaskDistanceView> masks() const { return masks_of_; }  // none, or one each
  // The weight that its mask leaves a lookup (PhotosView).
  double Unmasked(const PhotoLookup& lookup, const Vec3d& point) const {
    return ViewOf({}, {}).Unmasked(lookup, point);
  }

  // Calls visit(i, pyramid) once for every lookup whose photograph can be read, each photograph
  // decoded once, in parallel: two calls for one photograph may run at once. `what` is reported.
  void Visit(const std::vector<PhotoLookup>& lookups, const char* what,
             const std::function<void(std::size_t i, const PhotoPyramid& pyramid)>& visit,
             const Control& control);
  void Fetch(std::span<const PhotoRequest> requests,
             const std::function<void(std::size_t i, const PhotoPyramid* pyramid)>& visit,
             const Control& control) override;

  double seconds_decoding() const { return seconds_decoding_; }  // so far
  // Photographs that Visit and Fetch have decoded since the last ClearUsed.
  std::uint64_t used() const;
  const std::vector<bool>& used_photos() const { return used_; }
  void ClearUsed() { used_.assign(views_.size(), false); }
  std::uint64_t unreadable() const;
  const std::vector<std::string>& problems() const { return problems_; }  // one line each
  // For whoever asked for the photographs: a line for those that cannot be used, one for the masks
  // that cannot be read; none where all can.
  std::vector<std::string> Warnings() const;

 private:
  // Decodes the photographs, as many at a time as fit.
  void Decode(std::span<const PhotoRequest> requests, const char* what,
              const std::function<void(std::size_t i, const PhotoPyramid* pyramid)>& visit,
              const Control& control);

  const Survey& survey_;
  MaskDistances masks_;
  PhotoStore store_;
  std::vector<std::optional<PhotoView>> views_;
  std::vector<PhotoCamera> cameras_;        // of the views; not usable where there is none
  std::vector<MaskDistanceView> masks_of_;  // none where no photograph has one
  std::vector<bool> tried_, left_out_, used_;
  double seconds_decoding_ = 0;
  std::vector<std::string> problems_;
};

}  // namespace sherd
