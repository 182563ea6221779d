// Rays from surface points towards lights and the sky: whether the surface lies in their way. As
// the CPU's Occlusion::CastOne has it, a ray a thread, in three launches for a batch of rays:
//   CountOnRays    per ray: the metaballs it may meet, counted in a walk through the tree
//   (scan)         where each ray's list begins
//   ListOnRays     the same walk again, writing the lists
//   MarchRays      per ray: its list sorted, then the march of metaball/tile_march.h
// So lists may be of any length, and memory is what the batch needs. How many blocks each of these
// wants on a multiprocessor is said to the compiler, so that it has the registers to spill nothing.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/kernels/metaball_list.h"
#include "cuda/kernels/trace_params.h"
#include "metaball/appearance/occlusion_rays.h"
#include "metaball/appearance/ray_walk.h"
#include "metaball/appearance/support_tree_view.h"
#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/tile_march.h"

namespace sherd::kernels {

// The rays of a batch: from `count` samples that follow each other, one ray each towards a light or
// along every direction of the ambient light, direction by direction.
struct RayBatch {
  Camera camera;  // world, of the samples
  LocalFrame local;
  const float* depth = nullptr;  // planes of the samples
  const Vec3f* normal = nullptr;
  const std::int32_t* id = nullptr;
  MetaballArrays metaballs;
  double surface_radius_scale = 1.0;  // the surface's alone
  std::uint64_t first = 0;            // sample
  std::uint64_t count = 0;            // samples
  double bias = 0.05;                 // radii
  bool ambient = false;
  ShadowLight light;                 // where not ambient
  const Vec3d* direction = nullptr;  // where ambient
  int directions = 1;
  double reach = 0.0;  // of the ambient light, local units

  SHERD_HD std::uint64_t rays() const { return count * static_cast<std::uint64_t>(directions); }
  SHERD_HD std::size_t SampleOf(std::uint64_t ray) const { return first + ray % count; }

  // False where there is no ray to cast.
  SHERD_HD bool RayAt(std::uint64_t idx, OcclusionRay* ray) const {
    const std::size_t sample = SampleOf(idx);
    // A surface that lies on the rim of all supports may be nobody's.
    if (!(depth[sample] > 0.0f) || id[sample] < 0) return false;
    const int x = static_cast<int>(sample % camera.width);
    const int y = static_cast<int>(sample / camera.width);
    const double radius =
        static_cast<double>(metaballs.sphere[id[sample]].radius) * surface_radius_scale;
    const HitPoint hit = HitPointAt(camera, local, depth, camera.width, x, y, radius);
    if (!ambient) return light.RayTo(hit, normal[sample], bias, ray);
    const Vec3d along = direction[idx / count];
    if (!(AmbientWeight(normal[sample], along) > 0.0f)) return false;
    *ray = RayFrom(hit, along, bias, reach);
    return true;
  }
};

struct CountOnRays {
  static constexpr int kThreads = 128, kBlocksPerMultiprocessor = 8;  // 64 registers

  RayBatch batch;
  SupportTreeView tree;
  std::uint32_t* counts;  // a ray, and one more for the scan's sum

  SHERD_HD void operator()(std::uint64_t idx) const {
    std::uint32_t count = 0;
    OcclusionRay ray;
    if (idx < batch.rays() && batch.RayAt(idx, &ray)) {
      ForEachOnRay(tree, ray, [&](const TileEntry&) { ++count; });
    }
    counts[idx] = count;
  }
};

// Two kernels may round the same walk differently: what is listed is never more than was counted,
// and how many it is is written down.
struct ListOnRays {
  static constexpr int kThreads = 128, kBlocksPerMultiprocessor = 8;  // 64 registers

  RayBatch batch;
  SupportTreeView tree;
  const std::uint64_t* offsets;  // rays + 1
  TileEntry* entries;
  std::uint32_t* counts;  // a ray; of the entries listed

  SHERD_HD void operator()(std::uint64_t idx) const {
    const std::uint64_t room = offsets[idx + 1] - offsets[idx];
    TileEntry* const list = entries + offsets[idx];
    std::uint32_t count = 0;
    OcclusionRay ray;
    if (room > 0 && batch.RayAt(idx, &ray)) {
      ForEachOnRay(tree, ray, [&](const TileEntry& entry) {
        if (count < room) list[count++] = entry;
      });
    }
    counts[idx] = count;
  }
};

// By insertion where there are few; else by heap, which needs no more room.
SHERD_HD void SortEntries(TileEntry* entry, int n) {
  constexpr int kFew = 24;
  if (n <= kFew) {
    for (int i = 1; i < n; ++i) {
      const TileEntry moved = entry[i];
      int k = i;
      for (; k > 0 && IsBefore(moved, entry[k - 1]); --k) entry[k] = entry[k - 1];
      entry[k] = moved;
    }
    return;
  }
  const auto sift = [entry](int from, int size) {
    const TileEntry moved = entry[from];
    for (int child = 2 * from + 1; child < size; child = 2 * from + 1) {
      if (child + 1 < size && IsBefore(entry[child], entry[child + 1])) ++child;
      if (!IsBefore(moved, entry[child])) break;
      entry[from] = entry[child];
      from = child;
    }
    entry[from] = moved;
  };
  for (int i = n / 2 - 1; i >= 0; --i) sift(i, n);
  for (int last = n - 1; last > 0; --last) {
    const TileEntry largest = entry[0];
    entry[0] = entry[last];
    entry[last] = largest;
    sift(0, last);
  }
}

template <ThresholdMode kMode, class Real, class Shape>
struct MarchRays {
  static constexpr int kThreads = 128;
  static constexpr int kBlocksPerMultiprocessor = sizeof(Real) == 8 ? 3 : 4;  // 168, 128 registers
  static constexpr std::uint64_t kThreadsAtOnce = std::uint64_t{1} << 20;

  RayBatch batch;
  DensityShape shape;
  const std::uint64_t* offsets;
  const std::uint32_t* listed;  // entries a ray
  TileEntry* entries;
  std::uint8_t* occluded;  // a ray
  TraceCounts* counts;

  SHERD_HD void operator()(std::uint64_t idx) const {
    const std::uint64_t begin = offsets[idx];
    const auto count = static_cast<int>(listed[idx]);
    occluded[idx] = 0;
    OcclusionRay ray;
    if (count == 0 || !batch.RayAt(idx, &ray)) return;
    SortEntries(entries + begin, count);
    const RayList list(batch.metaballs, entries + begin, count);
    const RayD from{ray.origin + ray.direction * ray.begin, ray.direction};
    RayCounts own;
    const TileHit hit = MarchTile<kMode, Real>(list, ShapeFor<Shape>(shape), from, &own);
    occluded[idx] = hit.hit && hit.depth <= ray.end - ray.begin;
    if (own.unresolved != 0) {
      AtomicAdd(&counts->rare[TraceCounts::kUnresolved],
                static_cast<unsigned long long>(own.unresolved));
    }
  }
};

// One thread a sample of the batch: whether it sees the light.
struct TakeVisible {
  RayBatch batch;
  const std::uint8_t* occluded;
  std::uint8_t* visible;  // a sample of the picture

  SHERD_HD void operator()(std::uint64_t idx) const {
    visible[batch.SampleOf(idx)] = occluded[idx] ? 0 : 1;
  }
};

// One thread a sample of the batch: its share of the ambient light.
struct SumAmbient {
  RayBatch batch;
  const std::uint8_t* occluded;
  float* share;  // a sample of the picture

  SHERD_HD void operator()(std::uint64_t idx) const {
    const std::size_t sample = batch.SampleOf(idx);
    float shut = 0.0f, all = 0.0f;
    if (batch.depth[sample] > 0.0f) {
      for (int k = 0; k < batch.directions; ++k) {
        const float weight = AmbientWeight(batch.normal[sample], batch.direction[k]);
        all += weight;
        if (occluded[static_cast<std::uint64_t>(k) * batch.count + idx]) shut += weight;
      }
    }
    share[sample] = AmbientShare(shut, all);
  }
};

}  // namespace sherd::kernels
