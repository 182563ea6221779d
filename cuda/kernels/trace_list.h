// A ray at a time by the scalar march of metaball/tile_march.h, in double precision: the modes that
// are there to reproduce the thesis's thresholds (summed and gated). Slower than trace.h, which has
// what every picture is drawn with, and equal to the CPU's scalar renderer.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/kernels/device_ops.h"
#include "cuda/kernels/metaball_list.h"
#include "cuda/kernels/trace_params.h"
#include "metaball/camera.h"
#include "metaball/scene.h"
#include "metaball/shading.h"
#include "metaball/tile_march.h"

namespace sherd::kernels {

template <ThresholdMode kMode>
struct TraceList {
  // A long way for each: some millions may take seconds.
  static constexpr std::uint64_t kThreadsAtOnce = std::uint64_t{1} << 20;

  TraceParams p;
  int tiles_y = 0;

  std::uint64_t Threads() const {
    return static_cast<std::uint64_t>(p.tiles_x) * tiles_y * kTileRays;
  }

  // Threads go through the picture tile by tile: those that run together share a list.
  SHERD_HD void operator()(std::uint64_t thread) const {
    const auto tile = static_cast<int>(thread / kTileRays);
    const auto ray_in_tile = static_cast<int>(thread % kTileRays);
    const int x = tile % p.tiles_x * kTileSize + ray_in_tile % kTileSize;
    const int y = tile / p.tiles_x * kTileSize + ray_in_tile / kTileSize;
    if (x >= p.camera.width || y >= p.camera.height) return;
    const EntryRange range = p.range[tile];
    const ScreenTileList list(p.metaballs, p.entry + range.begin,
                              static_cast<int>(range.end - range.begin), p.front);
    const AnyShape shape{p.shape};
    const RayD ray = RayThrough(p.camera, x + 0.5, y + 0.5);
    RayCounts counts;
    const TileHit hit = MarchTile<kMode, double>(list, shape, ray, &counts);
    AddRare(TraceCounts::kStartedInside, counts.started_inside);
    AddRare(TraceCounts::kGrazing, counts.grazing);
    AddRare(TraceCounts::kUnresolved, counts.unresolved);
    Pixel pixel;
    Vec3f normal{};
    std::int32_t id = -1;
    if (hit.hit) {
      AddRare(TraceCounts::kHits, 1);
      const Vec3f to_viewer = -ray.direction.cast<float>();
      const SurfaceSums sums =
          GatherSurface<kMode>(list, shape, hit, [this](std::uint32_t i) { return p.ColorOf(i); });
      normal = sums.Normal(to_viewer);
      const Vec3f c = Shade(p.light, sums.BlendedColor(), normal, to_viewer);
      pixel = {c.x, c.y, c.z, 1.0f};
      id = sums.strongest_idx;
    }
    const std::size_t at = static_cast<std::size_t>(y) * p.camera.width + x;
    p.out_color[at] = pixel;
    if (p.out_depth) p.out_depth[at] = hit.hit ? WorldDepth(hit.depth, p.world_per_local) : 0.0f;
    if (p.out_normal) p.out_normal[at] = normal;
    if (p.out_id) p.out_id[at] = id;
    if (p.out_hit) p.out_hit[at] = hit.hit ? hit.depth : -1.0;
  }

 private:
  SHERD_HD void AddRare(TraceCounts::Rare what, std::uint32_t count) const {
    if (count != 0) AtomicAdd(&p.counts->rare[what], static_cast<unsigned long long>(count));
  }
};

}  // namespace sherd::kernels
