// Where, and over what area, a photograph is looked up.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "metaball/hostdevice.h"

namespace sherd {

struct PhotoLookup {
  std::uint32_t target = 0;  // whose colour it is part of
  std::uint32_t photo = 0;   // into Survey::photographs
  float x = 0, y = 0;        // pixels of the file
  // The footprint: a parallelogram around (x, y) with these sides, cut into along x across cells.
  float along_x = 0, along_y = 0, across_x = 0, across_y = 0;
  std::uint8_t along = 1, across = 1;  // 1 .. kMostCells
  std::uint8_t level = 0;              // of the pyramid
  float width_px = 1;                  // the footprint's shorter side, pixels of the file
  float weight = 0;

  static constexpr int kMostCells = 8;
};

// Gives the lookup the footprint whose sides have the images (ax, ay) and (bx, by): the axes of the
// ellipse they span (the singular vectors of [a b]). The level is the coarsest whose pixels are
// well below the shorter axis (a quarter to three quarters of it), so that the cells, not the
// pyramid's averages, shape the filter; a footprint too long for kMostCells takes a coarser one.
SHERD_HD void SetFootprint(double ax, double ay, double bx, double by, PhotoLookup* lookup) {
  constexpr double kMostCells = PhotoLookup::kMostCells;
  constexpr double kPixelsOfFootprint = 1.33;  // at least so many pixels of a level in its width
  const double e = (ax * ax + ay * ay + bx * bx + by * by) / 2;
  const double det = ax * by - ay * bx;
  const double root = std::sqrt(std::max(0.0, e * e - det * det));
  const double longer = std::sqrt(e + root);
  const double shorter = longer > 0 ? std::abs(det) / longer : 0;
  // The longer axis in the photograph: the eigenvector of a a^T + b b^T.
  const double xx = ax * ax + bx * bx, xy = ax * ay + bx * by, yy = ay * ay + by * by;
  double ux = xx - yy + 2 * root, uy = 2 * xy;
  if (std::abs(ux) + std::abs(uy) < 1e-12 * (xx + yy)) {
    ux = xx >= yy ? 1 : 0;
    uy = xx >= yy ? 0 : 1;
  }
  const double length = std::hypot(ux, uy);
  if (length > 0) {
    ux /= length;
    uy /= length;
  }
  double level = std::floor(std::log2(std::max(1.0, shorter / kPixelsOfFootprint)));
  level = std::max(level, std::ceil(std::log2(std::max(1.0, longer / kMostCells))));
  const double pixel = std::exp2(level);
  lookup->level = static_cast<std::uint8_t>(std::min(level, 30.0));
  lookup->along =
      static_cast<std::uint8_t>(std::clamp(std::ceil(longer / pixel - 0.01), 1.0, kMostCells));
  lookup->across =
      static_cast<std::uint8_t>(std::clamp(std::ceil(shorter / pixel - 0.01), 1.0, kMostCells));
  lookup->along_x = static_cast<float>(ux * longer);
  lookup->along_y = static_cast<float>(uy * longer);
  lookup->across_x = static_cast<float>(-uy * shorter);
  lookup->across_y = static_cast<float>(ux * shorter);
  lookup->width_px = static_cast<float>(shorter);
}

// How far from (x, y) SampleFootprint looks where the pyramid holds the lookup's level, pixels of
// the file.
SHERD_HD double FootprintReach(const PhotoLookup& lookup) {
  const double pixel = std::ldexp(1.0, lookup.level);
  // The corners of what the cubic takes, and of what is interpolated around the cells' centres.
  if (lookup.along == 1 && lookup.across == 1) return 2.5 * std::numbers::sqrt2 * pixel;
  const double sides = std::hypot(std::hypot(lookup.along_x, lookup.along_y),
                                  std::hypot(lookup.across_x, lookup.across_y));
  return sides / 2 + 1.5 * std::numbers::sqrt2 * pixel;
}

// The surroundings of a footprint are smoothed over 2^this of its width.
inline constexpr float kSurroundingsOctaves = 3;

// Over what width SampleSurroundings smooths, pixels of the file.
SHERD_HD double SurroundingsWidth(const PhotoLookup& lookup) {
  return std::exp2(kSurroundingsOctaves) * std::max(1.0, double(lookup.width_px));
}

}  // namespace sherd
