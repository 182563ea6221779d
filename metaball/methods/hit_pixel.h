// From a crossing to its pixel: colour blended by density (thesis 3.1), light (thesis 3.7), planes.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/frame.h"
#include "metaball/hostdevice.h"
#include "metaball/shading.h"
#include "metaball/tile_march.h"
#include "metaball/vec.h"

namespace sherd {

// Sums over the metaballs that form the surface at a point. A negative density gives no colour.
template <class Real>
struct BasicHitSums {
  Real weight = 0;       // sum of the positive f
  Vec3<Real> color{};    // sum f C, linear light
  Vec3<Real> outward{};  // towards the outside, any length
  Real strongest = -INFINITY;
  std::int32_t strongest_idx = -1;

  SHERD_HD void Add(const Vec3f& linear_color, std::uint32_t idx, Real f,
                    const Vec3<Real>& outward_share) {
    const Real positive = f > 0 ? f : Real(0);
    weight += positive;
    color += linear_color.cast<Real>() * positive;
    outward += outward_share;
    if (f > strongest) {
      strongest = f;
      strongest_idx = static_cast<std::int32_t>(idx);
    }
  }
};
using HitSums = BasicHitSums<double>;

// What a hit's pixel shows, and its unit normal.
struct LitHit {
  Pixel color;
  Vec3f normal;
};
// direction: of the ray, unit length.
template <class Real>
SHERD_HD LitHit LightHit(const FrameLight& light, const Vec3<Real>& direction,
                         const BasicHitSums<Real>& sums) {
  const Vec3<Real> blended = sums.weight > 0 ? sums.color / sums.weight : Vec3<Real>{};
  const Vec3f to_viewer = (-direction).template cast<float>();
  const Vec3f normal = Normalized(sums.outward, -direction).template cast<float>();
  const Vec3f c = Shade(light, blended.template cast<float>(), normal, to_viewer);
  return {{c.x, c.y, c.z, 1.0f}, normal};
}

// Writes what was summed up at `depth` (local units) along `ray` into the frame's planes.
inline void WriteHit(const Cloud& cloud, const FrameLight& light, const RayD& ray, double depth,
                     const HitSums& sums, std::size_t pixel, Frame* frame) {
  const LitHit hit = LightHit(light, ray.direction, sums);
  frame->color[pixel] = hit.color;
  if (!frame->depth.empty()) frame->depth[pixel] = WorldDepth(depth, cloud.frame.unit);
  if (!frame->normal.empty()) frame->normal[pixel] = hit.normal;
  if (!frame->id.empty()) frame->id[pixel] = sums.strongest_idx;
}

}  // namespace sherd
