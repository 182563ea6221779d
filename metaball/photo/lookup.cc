#include "metaball/photo/lookup.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "metaball/photo/filter.h"

namespace sherd {
namespace {

constexpr double kMostCells = PhotoLookup::kMostCells;
constexpr double kPixelsOfFootprint = 1.33;  // at least so many pixels of a level in its width

}  // namespace

void SetFootprint(double ax, double ay, double bx, double by, PhotoLookup* lookup) {
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

double FootprintReach(const PhotoLookup& lookup) {
  const double pixel = std::ldexp(1.0, lookup.level);
  // The corners of what the cubic takes, and of what is interpolated around the cells' centres.
  if (lookup.along == 1 && lookup.across == 1) return 2.5 * std::numbers::sqrt2 * pixel;
  const double sides = std::hypot(std::hypot(lookup.along_x, lookup.along_y),
                                  std::hypot(lookup.across_x, lookup.across_y));
  return sides / 2 + 1.5 * std::numbers::sqrt2 * pixel;
}

double SurroundingsWidth(const PhotoLookup& lookup) {
  return std::exp2(kSurroundingsOctaves) * std::max(1.0, double(lookup.width_px));
}

}  // namespace sherd
