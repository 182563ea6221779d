// How far the places of a photograph are from what its mask ignores. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "metaball/photo/mask_distance_view.h"
#include "reconstruction/survey.h"

namespace sherd {

// The distance to the nearest black pixel of a PhotoMask, on a grid that takes a byte a cell: what
// is looked up in a photograph has an extent, and a mask that is asked for each lookup must stay
// small beside the photographs.
class MaskDistance {
 public:
  static constexpr int kLargestSide = 1024;  // of the grid, cells; none is finer than a pixel

  // camera: of the original, in whose pixels everything is told. max_bytes: of the grid; at least
  // one cell is kept. Throws InputError where the mask cannot be read.
  MaskDistance(const std::string& path, const SurveyCamera& camera, std::size_t max_bytes);

  // From (x, y), in the picture, to the nearest black pixel of the mask: never more than it is, and
  // less by at most four cells, save that nothing above 62 cells is told. 0 on a black pixel;
  // infinity where the mask has none.
  double At(double x, double y) const { return view().At(x, y); }

  // Valid while this lives and is not moved.
  MaskDistanceView view() const {
    MaskDistanceView view = grid_;
    view.quarters = quarters_.empty() ? nullptr : quarters_.data();
    return view;
  }
  double cell_px() const { return grid_.cell_px; }  // the shorter side
  std::size_t MemoryBytes() const { return quarters_.capacity(); }

 private:
  MaskDistanceView grid_;               // all but the entries
  std::vector<std::uint8_t> quarters_;  // none: nothing is black
};

// Those of a survey's photographs, each read once. Without masks nothing is held or done.
class MaskDistances {
 public:
  // max_bytes: of all grids together, which decides how fine they are. The survey must outlive it.
  MaskDistances(const Survey& survey, std::size_t max_bytes);

  std::size_t max_bytes() const { return max_bytes_; }  // 0 without masks
  // Reads the masks of these photographs that were not asked for before, in parallel. Throws
  // Cancelled.
  void Read(const std::vector<bool>& photos, const Control& control);
  // Null where the photograph has none that could be read.
  const MaskDistance* Of(std::size_t photo) const {
    return photo < entries_.size() ? entries_[photo].mask.get() : nullptr;
  }
  // One line about the masks that could not be read; empty where all could.
  std::string Warning() const;

 private:
  struct Entry {
    std::unique_ptr<MaskDistance> mask;
    bool tried = false;
    std::string problem;
  };
  const Survey& survey_;
  std::size_t max_bytes_ = 0, bytes_of_each_ = 0;
  std::vector<Entry> entries_;  // by photograph; none where no photograph has a mask
};

}  // namespace sherd
