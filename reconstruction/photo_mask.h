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
  // Whether a pixel, inside, is black.
  bool IgnoresPixel(int x, int y) const {
    return ignored_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                    static_cast<std::size_t>(x)];
  }
  // Whether the place at these fractions of width and height, [0, 1), is ignored; true outside.
  bool Ignores(double u, double v) const;

 private:
  int width_ = 0, height_ = 0;
  std::vector<bool> ignored_;
};

// What people are told of `count` masks, at least one, that cannot be read; example: why one
// cannot.
std::string MasksLeftOut(std::size_t count, const std::string& example);

// Sets Photograph::mask_path where `folder` has one. Returns for how many.
std::size_t FindMasks(const std::string& folder, Survey* survey);

// Takes every photograph out of the lists of the points that it shows where its mask is black.
// Masks belong to the originals, whose camera says where that is. Masks that cannot be read are
// left out with one warning. Returns how many entries were removed. Throws Cancelled.
std::uint64_t ApplyMasks(Survey* survey, const Control& control = {});

}  // namespace sherd
