#include "reconstruction/radii.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "metaball/error.h"
#include "metaball/median.h"
#include "reconstruction/level.h"
#include "reconstruction/neighbors.h"
#include "reconstruction/parallel.h"

namespace sherd {

// Measured on sheets of 20 000 metaballs at the threshold 0.7 (tests/reconstruction/holes_test.cc
// keeps the check): planes in three directions and a sphere, points on a jittered grid or strewn
// at random, with noise of 0 to 1 spacing across the sheet, reduced 7 or 2 to 1 or not at all.
// Share of the sheet that is left open, the worst over noise and direction, in %:
//
//   radius / spacing          1.2    1.4    1.5    1.6    1.7    1.8    2.0
//   reduced 7:1, all          1.4    0.00   0.00   0.00   0.00   0.00   0.00
//   reduced 2:1, grid         0.5    0.00   0.00   0.00   0.00   0.00   0.00
//   reduced 2:1, random       4.8    0.49   0.11   0.02   0.01   0.00   0.00
//   not reduced, grid         1.8    0.02   0.00   0.00   0.00   0.00   0.00
//   not reduced, random      14      3.9    1.9    0.9    0.45   0.18   0.04
//
// The table is of metaballs that lie on the points. A sheet of density 1 / s^2 has the mean field
// (pi / 3) (r / s)^2 (1 - z^2 / r^2)^3 at height z, so that its surface stands 0.5 to 1.35 spacings
// in front of it; surface_fit.h takes the metaballs back by as much. 1.8 closes all that is
// reduced, and leaves next to nothing open where points lie as irregularly as points can. Larger
// factors are smoother, but the centres lie deeper (a thin wall has no room for them) and every ray
// meets more metaballs.
const double kDefaultRadiusFactor = 1.8;

namespace {

constexpr int kSpacingNeighbors = 8;
constexpr std::size_t kBlock = 4096;
// Radii stay within this factor of the level's median: a stray point must not become a balloon.
constexpr double kLargest = 3.0;
// And a metaball's spacing counts within this factor of the median around it.
constexpr double kSpeck = 1.25;
constexpr double kSmallest = 1.0 / 8.0;

// Metaballs that stand for one or two points lie as irregularly as these do, and with what the
// smoothing leaves of their noise: where more of them overlap, both even out. Mean distance to the
// truth and angle of the normals on the synthetic excavation (sherd_surface_benchmark), high-pass
// of the bust (sherd_fidelity_benchmark), by the points of a metaball:
//
//   radius / spacing           1.8              2.2              2.8
//   excavation, 9.5 points     1.01 mm  8.2 deg 1.31 mm  7.7 deg 2.55 mm  9.3 deg
//   excavation, 2.4            0.74     8.4     0.77     7.3     1.10     7.4
//   excavation, 1.2            0.79    10.2     0.78     8.7     0.99     8.0
//   bust, 1.5                  0.430            0.449            0.466
//   bust, 1.0                  0.421            0.435            0.455
//
// Each costs the renderer what its area is larger.
constexpr double kLoneFactor = 2.4;  // of metaballs that are points
constexpr double kManyPoints = 4.0;  // from here on the default

}  // namespace

double DefaultRadiusFactor(double points_per_metaball) {
  const double lone = std::clamp((kManyPoints - points_per_metaball) / (kManyPoints - 1), 0.0, 1.0);
  return kDefaultRadiusFactor + lone * (kLoneFactor - kDefaultRadiusFactor);
}

Radii ComputeRadii(const std::vector<Vec3d>& positions, double radius_factor,
                   const Control& control) {
  const double factor = radius_factor > 0 ? radius_factor : kDefaultRadiusFactor;
  if (!std::isfinite(factor)) throw Error("the radius factor must be finite");
  Radii out;
  const std::size_t n = positions.size();
  if (n == 0) return out;
  const NeighborSearch search(positions);
  std::vector<double> own(n, 0.0);
  constexpr int kAround = kSpacingNeighbors + 1;  // the point itself included
  const int found = static_cast<int>(std::min<std::size_t>(kAround, n));
  std::vector<int> neighbors(n * kAround);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        float distance[kAround];
        for (std::size_t i = begin; i < end; ++i) {
          const int k = search.Nearest(i, kAround, &neighbors[i * kAround], distance) - 1;
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
  const double median = positive.empty() ? 1.0 : Median(std::move(positive));
  out.median_spacing = median;

  // A point's own spacing within the bounds its neighbours set: no smaller than their median (at
  // the rim of a gap a point's nearest neighbours lie on the dense side), and not far above it (a
  // speck off a dense surface must not become a balloon there).
  out.spacing.assign(n, 0.0);
  out.radius.assign(n, 0.0);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        double around[kAround];
        for (std::size_t i = begin; i < end; ++i) {
          for (int j = 0; j < found; ++j) {
            around[j] = own[static_cast<std::size_t>(neighbors[i * kAround + j])];
          }
          std::nth_element(around, around + found / 2, around + found);
          const double typical = around[found / 2];
          const double local = typical > 0 ? std::clamp(own[i], typical, kSpeck * typical) : own[i];
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
