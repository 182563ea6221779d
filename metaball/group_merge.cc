#include "metaball/group_merge.h"

#include <algorithm>
#include <cmath>

#include "metaball/density/shapes.h"

namespace sherd {
namespace {

constexpr int kPlaneSteps = 2048;
constexpr int kGrowthSteps = 1024;
constexpr double kGrowthOctaves = 5;  // a merged radius is at most 32 times its largest member's
constexpr int kReachCounts = 256;
// Cell edges: four on the corners of a square then hold its middle with twice a usual threshold.
constexpr double kClosedSupport = 1.1;

}  // namespace

double DistanceOfValue(const DensityShape& shape, double value) {
  if (!(ShapeValue(shape, 0.0) >= value)) return 0;
  double lo = 0, hi = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (lo + hi);
    (ShapeValue(shape, middle * middle) >= value ? lo : hi) = middle;
  }
  return lo;
}

std::string GroupMerge::WhyNot(const Surface& surface) {
  if (surface.mode != ThresholdMode::kUniform) {
    return "no error can be stated for thresholds that are not uniform";
  }
  if (!IsNonNegative(surface.density)) {
    return "no error can be stated for a density with negative parts";
  }
  if (!(PeakOf(surface.density) >= surface.threshold)) {
    return "no error can be stated for a threshold that one metaball alone does not reach";
  }
  return {};
}

GroupMerge::GroupMerge(const Surface& surface, double offset) {
  const ResolvedDensity density = ResolveDensity(surface.density);
  const double threshold = surface.threshold / density.amplitude;
  scale_ = surface.radius_scale * density.support;
  core_ = DistanceOfValue(density.shape, threshold);
  offset_ = std::clamp(offset, core_, 0.98);
  // The integral of the shape from u to 1, which pi r^2 turns into that over a plane.
  plane_sum_.assign(kPlaneSteps + 1, 0.0);
  for (int k = kPlaneSteps - 1; k >= 0; --k) {
    plane_sum_[k] = plane_sum_[k + 1] +
                    ShapeValue(density.shape, (k + 0.5) / kPlaneSteps) * (1.0 / kPlaneSteps);
  }
  growth_.resize(kGrowthSteps + 1);
  for (int k = 0; k <= kGrowthSteps; ++k) {
    const double q = std::exp2(kGrowthOctaves * k / kGrowthSteps);
    growth_[k] = q * q * PlaneSum(offset_ / q);
  }
  reach_.resize(kReachCounts);
  for (int k = 1; k < kReachCounts; ++k) {
    reach_[k] = DistanceOfValue(density.shape, threshold / k);
  }
}

double GroupMerge::PlaneSum(double height) const {
  const double at = height * height * kPlaneSteps;
  if (!(at < kPlaneSteps)) return 0;
  const auto k = static_cast<std::size_t>(at);
  const double part = at - static_cast<double>(k);
  return plane_sum_[k] * (1 - part) + plane_sum_[k + 1] * part;
}

double GroupMerge::GrowthFor(double sum) const {
  const auto above = std::upper_bound(growth_.begin(), growth_.end(), sum);
  if (above == growth_.begin()) return 1;
  if (above == growth_.end()) return std::exp2(kGrowthOctaves);
  const double part = (sum - above[-1]) / (*above - above[-1]);
  const double step = static_cast<double>(above - growth_.begin()) - 1 + part;
  return std::exp2(kGrowthOctaves * step / kGrowthSteps);
}

MergedMetaball GroupMerge::Merge(const Cloud& cloud, std::span<const std::uint32_t> members,
                                 double cell_edge) const {
  float largest = 0;
  for (const std::uint32_t i : members) largest = std::max(largest, cloud.RadiusOf(i));
  Vec3d sum{};
  double weights = 0, plane = 0;
  for (const std::uint32_t i : members) {
    const double share = static_cast<double>(cloud.RadiusOf(i)) / largest;  // in (0, 1]
    sum = sum + share * share * cloud.center[i].cast<double>();
    weights += share * share;
    if (share > offset_) plane += share * share * PlaneSum(offset_ / share);
  }
  MergedMetaball merged;
  merged.center = (sum / weights).cast<float>();
  const Vec3d center = merged.center.cast<double>();
  double farthest = 0, nearest = INFINITY;
  for (const std::uint32_t i : members) {
    const double d = Length(cloud.center[i].cast<double>() - center);
    farthest = std::max(farthest, d);
    if (d < nearest) {
      nearest = d;
      merged.representative = i;
    }
  }
  const double support = SupportOf(largest);
  const double reach = members.size() < reach_.size() ? reach_[members.size()] : 1.0;
  const double most = (farthest + reach * support) / (core_ > 0 ? core_ * support : support);
  const double closed = kClosedSupport * cell_edge / support;
  const double growth = std::max(1.0, std::min(std::max(GrowthFor(plane), closed), most));
  merged.radius = static_cast<float>(largest * growth);

  const double merged_support = SupportOf(merged.radius);
  double outwards = 0, inwards = INFINITY;
  for (const std::uint32_t i : members) {
    const double s = SupportOf(cloud.RadiusOf(i));
    const double d = Length(cloud.center[i].cast<double>() - center);
    outwards = std::max(outwards, s + d - core_ * merged_support);
    inwards = std::min(inwards, merged_support + d - core_ * s);
  }
  merged.error = std::max({0.0, outwards, inwards});
  return merged;
}

}  // namespace sherd
