#include <type_traits>
#include <vector>

#include "metaball/trace_job.h"

namespace sherd {
namespace {

template <ThresholdMode kMode, class Real, class Shape>
void TraceTile(const TraceJob& job, int tile, TraceCounts* counts, const Shape& shape) {
  const TileList list = job.ListOf(tile);
  Frame& frame = *job.frame;
  const PixelBox pixels = job.bins->PixelsOf(tile);
  const auto color_of = [&cloud = *job.cloud](std::uint32_t i) {
    return LinearFromRgb8(cloud.ColorOf(i));
  };
  for (int y = pixels.y0; y < pixels.y1; ++y) {
    for (int x = pixels.x0; x < pixels.x1; ++x) {
      const RayD ray = RayThrough(job.camera, x + 0.5, y + 0.5);
      const TileHit hit = MarchTile<kMode, Real>(list, shape, ray, &counts->rays);
      if (counts->rays.crowded > 0) return;
      if (!hit.hit) continue;
      ++counts->hits;
      const Vec3f to_viewer = -ray.direction.cast<float>();
      const SurfaceSums sums = GatherSurface<kMode>(list, shape, hit, color_of);
      const Vec3f normal =
          kMode == ThresholdMode::kBlended ? sums.BlendedNormal(to_viewer) : sums.Normal(to_viewer);
      const Vec3f c = Shade(job.light, sums.BlendedColor(), normal, to_viewer);
      const std::size_t pixel = static_cast<std::size_t>(y) * frame.width + x;
      frame.color[pixel] = {c.x, c.y, c.z, 1.0f};
      if (!frame.depth.empty()) frame.depth[pixel] = WorldDepth(hit.depth, job.cloud->frame.unit);
      if (!frame.normal.empty()) frame.normal[pixel] = normal;
      if (!frame.id.empty()) frame.id[pixel] = sums.strongest_idx;
      if (job.gather) {
        std::vector<GatherSphere>& spheres = GatherScratch();
        for (int k = hit.begin; k < hit.end; ++k) {
          const std::uint32_t i = list.MetaballAt(k);
          spheres.push_back({Minus(list.CenterOf(i), hit.reference), 1.0f / list.RadiusOf(i), i});
        }
        job.gather->AtHit(pixel, Vec3f{}, spheres);
      }
    }
  }
}

template <ThresholdMode kMode, class Real>
void TraceAnyShape(const TraceJob& job, int tile, TraceCounts* counts) {
  WithShape(job.shape,
            [&](const auto& shape) { TraceTile<kMode, Real>(job, tile, counts, shape); });
}

template <ThresholdMode kMode>
TileTracer TracerOf(bool double_precision) {
  return double_precision ? &TraceAnyShape<kMode, double> : &TraceAnyShape<kMode, float>;
}

}  // namespace

TileTracer ScalarTracerFor(const TraceJob& job) {
  switch (job.mode) {
    case ThresholdMode::kBlended:
      return TracerOf<ThresholdMode::kBlended>(job.double_precision);
    case ThresholdMode::kSummed:
      return TracerOf<ThresholdMode::kSummed>(job.double_precision);
    case ThresholdMode::kGated:
      return TracerOf<ThresholdMode::kGated>(job.double_precision);
    case ThresholdMode::kUniform:
      break;
  }
  return TracerOf<ThresholdMode::kUniform>(job.double_precision);
}

}  // namespace sherd
