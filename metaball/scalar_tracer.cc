#include <algorithm>

#include "metaball/trace_job.h"

namespace sherd {

void TraceTileScalar(const TraceJob& job, int tile, TraceCounts* counts) {
  const TileList list = job.ListOf(tile);
  Frame& frame = *job.frame;
  const int x0 = tile % job.bins->tiles_x() * kTileSize;
  const int y0 = tile / job.bins->tiles_x() * kTileSize;
  const int x1 = std::min(x0 + kTileSize, frame.width);
  const int y1 = std::min(y0 + kTileSize, frame.height);
  const Rgb8* colors = job.cloud->color.empty() ? nullptr : job.cloud->color.data();
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const RayD ray = RayThrough(job.camera, x + 0.5, y + 0.5);
      const TileHit hit = MarchTile(list, ray, job.threshold, &counts->rays);
      if (!hit.hit) continue;
      ++counts->hits;
      const Vec3f direction = ray.direction.cast<float>();
      const SurfaceSums sums = GatherSurface(list, hit, direction, colors, job.cloud->uniform_color,
                                             SrgbToLinearTable());
      const Vec3f normal = sums.Normal(-direction);
      const Vec3f c = Shade(job.light, sums.BlendedColor(), normal, -direction);
      const std::size_t pixel = static_cast<std::size_t>(y) * frame.width + x;
      frame.color[pixel] = {c.x, c.y, c.z, 1.0f};
      if (!frame.depth.empty()) frame.depth[pixel] = WorldDepth(hit.depth, job.cloud->frame.unit);
      if (!frame.normal.empty()) frame.normal[pixel] = normal;
      if (!frame.id.empty()) frame.id[pixel] = sums.strongest_idx;
    }
  }
}

}  // namespace sherd
