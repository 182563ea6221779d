#include "metaball/appearance/occlusion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "metaball/appearance/ray_walk.h"
#include "metaball/precision.h"

namespace sherd {
namespace {

// The usual case for each shape by itself; the rest, less often asked for, in doubles for any.
TileHit MarchAny(const OcclusionJob& job, const TileList& list, const RayD& ray,
                 RayCounts* counts) {
  const AnyShape any{job.shape};
  switch (job.mode) {
    case ThresholdMode::kBlended:
      return MarchTile<ThresholdMode::kBlended, double>(list, any, ray, counts);
    case ThresholdMode::kSummed:
      return MarchTile<ThresholdMode::kSummed, double>(list, any, ray, counts);
    case ThresholdMode::kGated:
      return MarchTile<ThresholdMode::kGated, double>(list, any, ray, counts);
    case ThresholdMode::kUniform:
      break;
  }
  if (job.double_precision) {
    return MarchTile<ThresholdMode::kUniform, double>(list, any, ray, counts);
  }
  return WithShape(job.shape, [&](const auto& s) {
    return MarchTile<ThresholdMode::kUniform, float>(list, s, ray, counts);
  });
}

}  // namespace

Vec3d FibonacciDirection(int k, int n) {
  const double z = 1 - (2.0 * k + 1) / n;
  const double around = std::sqrt(std::max(0.0, 1 - z * z));
  const double angle = 2 * std::numbers::pi * k / std::numbers::phi;
  return {around * std::cos(angle), around * std::sin(angle), z};
}

Beam BeamThrough(const SupportTreeView& tree, const Vec3d& origin, const Vec3d& direction,
                 double spread, double begin, double end) {
  return tree.BeamAlong(origin, direction, spread, begin, end);
}

Occlusion::Occlusion(const Scene& scene, int threads)
    : tree_(*scene.cloud,
            scene.surface.radius_scale * ResolveDensity(scene.surface.density).support, threads) {
  const Cloud& cloud = *scene.cloud;
  const ResolvedDensity density = ResolveDensity(scene.surface.density);
  job_.tree = tree_.view();
  job_.shape = density.shape;
  job_.mode = scene.surface.mode;
  job_.double_precision = HasWideRadii(cloud) || HasStiffThreshold(scene.surface);
  TileList& list = job_.list;
  list.center = cloud.center.data();
  list.radius = cloud.radius.empty() ? nullptr : cloud.radius.data();
  list.uniform_radius = cloud.uniform_radius;
  list.radius_scale = scene.surface.radius_scale * density.support;
  const bool own_threshold = job_.mode != ThresholdMode::kUniform && !cloud.threshold.empty();
  list.threshold = own_threshold ? cloud.threshold.data() : nullptr;
  list.uniform_threshold = scene.surface.threshold;
  list.threshold_scale = 1.0 / density.amplitude;
#ifdef SHERD_HAVE_HIGHWAY
  packets_ = PacketCasterFor(job_);
#endif
}

void Occlusion::Cast(const OcclusionRay* rays, int count, Scratch* scratch,
                     std::uint8_t* occluded) const {
  if (packets_) {
    packets_(job_, rays, count, &scratch->counts, occluded);
    return;
  }
  for (int i = 0; i < count; ++i) occluded[i] = CastOne(rays[i], scratch);
}

bool Occlusion::CastOne(const OcclusionRay& ray, Scratch* scratch) const {
  std::vector<TileEntry>& entries = scratch->entries;
  entries.clear();
  ForEachOnRay(job_.tree, ray, [&](const TileEntry& entry) { entries.push_back(entry); });
  if (entries.empty()) return false;
  // The list of a tile that only this ray passes.
  std::sort(entries.begin(), entries.end(), IsBefore);
  TileList list = job_.list;
  list.entry = entries.data();
  list.count = static_cast<int>(entries.size());
  const RayD from{ray.origin + ray.direction * ray.begin, ray.direction};
  const TileHit hit = MarchAny(job_, list, from, &scratch->counts);
  return hit.hit && hit.depth <= ray.end - ray.begin;
}

}  // namespace sherd
