#include "metaball/appearance/hit_groups.h"

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "metaball/parallel.h"

namespace sherd {
namespace {

constexpr int kSide = 8;  // pixels a side of a tile
// A group wider than this many pixels' own size and this many radii is split: its rays would share
// too little.
constexpr double kWidestInPixels = 24;
constexpr double kWidestInRadii = 8;

// The bits of a number below 64, taken apart into x (even ones) and y (odd ones): neighbours in
// this order are neighbours in the tile.
int EvenBits(int v) { return (v & 1) | (v >> 1 & 2) | (v >> 2 & 4); }

using Group = std::vector<HitPoint>;

template <class Visit>
void SplitAndVisit(const Group& group, double widest, const Visit& visit) {
  Vec3d lo = group[0].position, hi = lo;
  for (const HitPoint& hit : group) {
    const Vec3d& p = hit.position;
    lo = {std::min(lo.x, p.x), std::min(lo.y, p.y), std::min(lo.z, p.z)};
    hi = {std::max(hi.x, p.x), std::max(hi.y, p.y), std::max(hi.z, p.z)};
  }
  const Vec3d size = hi - lo;
  if (group.size() == 1 || !(Length(size) > widest)) {
    visit(group);
    return;
  }
  const auto along = [&](const Vec3d& p) {
    if (size.x >= size.y && size.x >= size.z) return p.x;
    return size.y >= size.z ? p.y : p.z;
  };
  const double middle = 0.5 * (along(lo) + along(hi));
  Group low, high;
  for (const HitPoint& hit : group) (along(hit.position) < middle ? low : high).push_back(hit);
  if (low.empty() || high.empty()) {  // only rounding is left between them
    visit(group);
    return;
  }
  SplitAndVisit(low, widest, visit);
  SplitAndVisit(high, widest, visit);
}

}  // namespace

void ForEachHitGroup(const Scene& scene, const Camera& camera, const Frame& frame, int threads,
                     const Control& control,
                     const std::function<void(const std::vector<HitPoint>&, int worker)>& visit) {
  const Cloud& cloud = *scene.cloud;
  const int tiles_x = (frame.width + kSide - 1) / kSide;
  const int tiles_y = (frame.height + kSide - 1) / kSide;
  std::atomic<int> done{0};
  ParallelFor(tiles_y, threads, [&](std::int64_t tile_y, int worker) {
    Group tile;
    for (int tile_x = 0; tile_x < tiles_x; ++tile_x) {
      control.ThrowIfStopped();
      tile.clear();
      double nearest = INFINITY;
      for (int k = 0; k < kSide * kSide; ++k) {
        const int x = tile_x * kSide + EvenBits(k);
        const int y = static_cast<int>(tile_y) * kSide + EvenBits(k >> 1);
        if (x >= frame.width || y >= frame.height) continue;
        const std::size_t pixel = static_cast<std::size_t>(y) * frame.width + x;
        const double depth = frame.depth[pixel];
        // A surface that lies on the rim of all supports may be nobody's.
        if (!(depth > 0) || frame.id[pixel] < 0) continue;
        const double radius =
            static_cast<double>(cloud.RadiusOf(frame.id[pixel])) * scene.surface.radius_scale;
        tile.push_back(
            HitPointAt(camera, cloud.frame, frame.depth.data(), frame.width, x, y, radius));
        nearest = std::min(nearest, depth);
      }
      if (tile.empty()) continue;
      const double pixel_size = camera.PixelSizeAt(nearest) / cloud.frame.unit;
      const double widest = std::max(kWidestInPixels * pixel_size, kWidestInRadii * tile[0].radius);
      SplitAndVisit(tile, widest, [&](const Group& group) { visit(group, worker); });
    }
    const int finished = ++done;
    if (worker == 0) control.Report("shadows", static_cast<double>(finished) / tiles_y);
  });
}

}  // namespace sherd
