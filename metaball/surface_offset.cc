#include "metaball/surface_offset.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "metaball/density/shapes.h"
#include "metaball/group_merge.h"
#include "metaball/median.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kSamples = 64;
constexpr std::size_t kMostNeighbors = 2048;  // beyond it each stands for several
constexpr double kFarthest = 2.0;             // supports from the centre
constexpr double kStep = 1.0 / 16;

// Metaballs around a sample, in its supports from its centre.
struct Neighborhood {
  DensityShape shape;
  double level = 0, each = 1;
  std::vector<Vec3d> center;
  std::vector<double> inverse2;

  double Field(const Vec3d& p) const {
    double sum = 0;
    for (std::size_t k = 0; k < center.size(); ++k) {
      const Vec3d d = p - center[k];
      sum += ShapeValue(shape, Dot(d, d) * inverse2[k]);
    }
    return sum * each;
  }
  Vec3d Downhill(const Vec3d& p) const {
    Vec3d sum{};
    for (std::size_t k = 0; k < center.size(); ++k) {
      const Vec3d d = p - center[k];
      sum = sum - ShapeSlope(shape, Dot(d, d) * inverse2[k]) * inverse2[k] * d;
    }
    return sum;
  }
  // Where the field first falls below the threshold from the centre on, no farther than `limit`.
  double Leaves(const Vec3d& direction, double limit) const {
    double before = Field({});
    if (!(before >= level)) return 0;
    for (double t = kStep; t < limit + kStep; t += kStep) {
      const double here = Field(t * direction);
      if (here < level) return t - kStep * (level - here) / (before - here);
      before = here;
    }
    return INFINITY;
  }
};

double OffsetAt(Neighborhood* around) {
  double best = INFINITY;
  Vec3d direction{};
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        const Vec3d d = Normalized(Vec3d{double(x), double(y), double(z)});
        const double t = around->Leaves(d, std::min(best, kFarthest));
        if (t >= best) continue;
        best = t;
        direction = d;
      }
    }
  }
  // Towards the surface's own normal there.
  for (int i = 0; i < 2 && std::isfinite(best); ++i) {
    const Vec3d down = around->Downhill(best * direction);
    if (!(Length(down) > 0)) break;
    const double t = around->Leaves(Normalized(down), best);
    if (!(t < best)) break;
    best = t;
    direction = Normalized(down);
  }
  return best;
}

}  // namespace

double MeasureSurfaceOffset(const Cloud& cloud, const Surface& surface, int threads) {
  const ResolvedDensity density = ResolveDensity(surface.density);
  const double scale = surface.radius_scale * density.support;
  const double level = surface.threshold / density.amplitude;
  const std::size_t n = cloud.size(), samples = std::min(n, kSamples);
  std::vector<double> offsets(samples, INFINITY);
  ParallelFor(static_cast<std::int64_t>(samples), threads, [&](std::int64_t s, int) {
    const std::size_t i = (2 * static_cast<std::size_t>(s) + 1) * n / (2 * samples);
    const Vec3d center = cloud.center[i].cast<double>();
    const double support = cloud.RadiusOf(i) * scale;
    std::vector<std::size_t> near;
    for (std::size_t k = 0; k < n; ++k) {
      const Vec3d d = cloud.center[k].cast<double>() - center;
      const double reach = (kFarthest + kStep) * support + cloud.RadiusOf(k) * scale;
      if (Dot(d, d) < reach * reach) near.push_back(k);
    }
    const std::size_t stride = (near.size() + kMostNeighbors - 1) / kMostNeighbors;
    Neighborhood around{density.shape, level, static_cast<double>(stride), {}, {}};
    for (std::size_t k = 0; k < near.size(); k += stride) {
      around.center.push_back((cloud.center[near[k]].cast<double>() - center) / support);
      const double ratio = support / (cloud.RadiusOf(near[k]) * scale);
      around.inverse2.push_back(ratio * ratio);
    }
    offsets[static_cast<std::size_t>(s)] = OffsetAt(&around);
  });
  std::erase_if(offsets, [](double v) { return !std::isfinite(v); });
  if (offsets.empty()) return DistanceOfValue(density.shape, level);
  return Median(std::move(offsets));
}

}  // namespace sherd
