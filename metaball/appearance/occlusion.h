// Whether something lies between two points: rays from surface points towards lights and the sky.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/appearance/occlusion_job.h"
#include "metaball/appearance/support_tree.h"
#include "metaball/scene.h"
#include "metaball/tile_march.h"
#include "metaball/vec.h"

namespace sherd {

// A scene's cloud, made ready for one frame's rays. The scene's cloud must live on unchanged.
// Immutable: safe from several threads, each with a scratch of its own.
class Occlusion {
 public:
  // The cloud must not be empty.
  Occlusion(const Scene& scene, int threads);
  Occlusion(const Occlusion&) = delete;
  Occlusion& operator=(const Occlusion&) = delete;

  // What a thread works with.
  struct Scratch {
    std::vector<TileEntry> entries;
    RayCounts counts;
  };

  // occluded[i]: whether F reaches the threshold anywhere on ray i; so also where the ray begins
  // inside the surface. Rays that are given together share work where they
  // are near each other and nearly parallel; the answers do not depend on that but for rounding.
  void Cast(const OcclusionRay* rays, int count, Scratch* scratch, std::uint8_t* occluded) const;
  // The same for one ray by the march of tile_march.h: the truth that Cast is tested against, and
  // what Cast does for summed and gated thresholds and on machines it has no vectors for.
  bool CastOne(const OcclusionRay& ray, Scratch* scratch) const;

 private:
  SupportTree tree_;
  OcclusionJob job_;
  OcclusionCaster packets_ = nullptr;
};

// The k-th of n directions that cover the sphere evenly (Fibonacci lattice, Gonzalez 2010). Unit.
Vec3d FibonacciDirection(int k, int n);

}  // namespace sherd
