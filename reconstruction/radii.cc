#include "reconstruction/radii.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "metaball/error.h"
#include "reconstruction/level.h"
#include "reconstruction/neighbors.h"
#include "reconstruction/parallel.h"

namespace sherd {

const double kDefaultRadiusFactor = 2.0;

namespace {

constexpr int kSpacingNeighbors = 8;
constexpr std::size_t kBlock = 4096;
// Radii stay within this factor of the level's median: a stray point must not become a balloon.
constexpr double kLargest = 2.5;
constexpr double kSpeck = 1.25;
constexpr double kSmallest = 1.0 / 8.0;

double MedianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Radii ComputeRadii(const std::vector<Vec3d>& positions, double radius_factor,
                   const Control& control) {
  const double factor = radius_factor > 0 ? radius_factor : kDefaultRadiusFactor;
  if (!std::isfinite(factor)) throw Error("the radius factor must be finite");
  Radii out;
  const std::size_t n = positions.size();
  if (n == 0) return out;
  const NeighborSearch search(positions);
  std::vector<double> own(n, 0.0);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kSpacingNeighbors + 1];
        float distance[kSpacingNeighbors + 1];
        for (std::size_t i = begin; i < end; ++i) {
          const int k = search.Nearest(i, kSpacingNeighbors + 1, idx, distance) - 1;
          if (k > 0) own[i] = distance[k] * std::sqrt(std::numbers::pi / k);
        }
      },
      control, "measuring the spacing", 0.5, 0.75);

  std::vector<double> positive;
  positive.reserve(n);
  for (const double s : own) {
    if (s > 0) positive.push_back(s);
  }
  // One point, or nothing but coincident ones: there is no scale but 1.
  const double median = positive.empty() ? 1.0 : MedianOf(std::move(positive));
  out.median_spacing = median;

  // At the rim of a gap a point's nearest neighbours lie on the dense side: it takes the median
  // around it where that is larger. A speck off a dense surface has a spacing of its own far above
  // its neighbours': it must not become a balloon and stays near the median around it.
  out.spacing.assign(n, 0.0);
  out.radius.assign(n, 0.0);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kSpacingNeighbors + 1];
        float distance[kSpacingNeighbors + 1];
        double around[kSpacingNeighbors + 1];
        for (std::size_t i = begin; i < end; ++i) {
          const int count = search.Nearest(i, kSpacingNeighbors + 1, idx, distance);
          for (int j = 0; j < count; ++j) around[j] = own[idx[j]];
          std::nth_element(around, around + count / 2, around + count);
          const double median_around = around[count / 2];
          const double local = median_around > 0
                                   ? std::clamp(own[i], median_around, kSpeck * median_around)
                                   : own[i];
          out.spacing[i] = local > 0 ? local : median;
          out.radius[i] =
              factor * std::clamp(out.spacing[i], kSmallest * median, kLargest * median);
        }
      },
      control, "choosing the radii", 0.75, 0.95);
  std::size_t open = 0;
  for (const double s : out.spacing) open += s > kLargest * median;
  out.open_share = static_cast<double>(open) / static_cast<double>(n);
  return out;
}

std::vector<double> RadiiFromSpacing(const std::vector<Vec3d>& positions, double radius_factor,
                                     std::vector<double>* spacing) {
  // Points that are not finite take no part; they get the median radius (BuildCloud drops them).
  std::vector<Vec3d> finite;
  finite.reserve(positions.size());
  for (const Vec3d& p : positions) {
    if (IsFinite(p)) finite.push_back(p);
  }
  Radii radii = ComputeRadii(finite, radius_factor);
  if (finite.size() < positions.size()) {
    const double factor = radius_factor > 0 ? radius_factor : kDefaultRadiusFactor;
    const double median = finite.empty() ? 1.0 : radii.median_spacing;
    Radii all;
    std::size_t next = 0;
    for (const Vec3d& p : positions) {
      const bool ok = IsFinite(p);
      all.radius.push_back(ok ? radii.radius[next] : factor * median);
      all.spacing.push_back(ok ? radii.spacing[next] : median);
      next += ok;
    }
    radii = std::move(all);
  }
  if (spacing) *spacing = std::move(radii.spacing);
  return std::move(radii.radius);
}

}  // namespace sherd
