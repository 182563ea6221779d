// Parts of photographs that are not to be looked at.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

// A mask in COLMAP's convention (ImageReader.mask_path): the picture DIR/<photograph's name>.png,
// of the photograph's size or a resize of it, in which black pixels are ignored.
class PhotoMask {
 public:
  // Throws InputError.
  explicit PhotoMask(const std::string& path);

  int width() const { return width_; }
  int height() const { return height_; }
  // Whether the place at these fractions of width and height, [0, 1), is ignored; true outside.
  bool Ignores(double u, double v) const;

 private:
  int width_ = 0, height_ = 0;
  std::vector<bool> ignored_;
};

// Sets Photograph::mask_path where `folder` has one. Returns for how many.
std::size_t FindMasks(const std::string& folder, Survey* survey);

// Takes every photograph out of the lists of the points that it shows where its mask is black.
// Masks belong to the originals, whose camera says where that is. Masks that cannot be read are
// left out with one warning. Returns how many entries were removed. Throws Cancelled.
std::uint64_t ApplyMasks(Survey* survey, const Control& control = {});

}  // namespace sherd
