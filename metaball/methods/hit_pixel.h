// From a crossing to its pixel: colour blended by density (thesis 3.1), light (thesis 3.7), planes.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/frame.h"
#include "metaball/shading.h"
#include "metaball/tile_march.h"
#include "metaball/vec.h"

namespace sherd {

// Sums over the metaballs that form the surface at a point. A negative density gives no colour.
struct HitSums {
  double weight = 0.0;  // sum of the positive f
  Vec3d color{};        // sum f C, linear light
  Vec3d outward{};      // towards the outside, any length
  double strongest = -INFINITY;
  std::int32_t strongest_idx = -1;

  void Add(const Cloud& cloud, std::uint32_t idx, double f, const Vec3d& outward_share) {
    const double positive = f > 0 ? f : 0.0;
    weight += positive;
    color += LinearFromRgb8(cloud.ColorOf(idx)).cast<double>() * positive;
    outward += outward_share;
    if (f > strongest) {
      strongest = f;
      strongest_idx = static_cast<std::int32_t>(idx);
    }
  }
};

// Writes what was summed up at `depth` (local units) along `ray` into the frame's planes.
inline void WriteHit(const Cloud& cloud, const FrameLight& light, const RayD& ray, double depth,
                     const HitSums& sums, std::size_t pixel, Frame* frame) {
  const Vec3d blended = sums.weight > 0 ? sums.color / sums.weight : Vec3d{};
  const Vec3f to_viewer = (-ray.direction).cast<float>();
  const Vec3f normal = Normalized(sums.outward, -ray.direction).cast<float>();
  const Vec3f c = Shade(light, blended.cast<float>(), normal, to_viewer);
  frame->color[pixel] = {c.x, c.y, c.z, 1.0f};
  if (!frame->depth.empty()) frame->depth[pixel] = WorldDepth(depth, cloud.frame.unit);
  if (!frame->normal.empty()) frame->normal[pixel] = normal;
  if (!frame->id.empty()) frame->id[pixel] = sums.strongest_idx;
}

}  // namespace sherd
