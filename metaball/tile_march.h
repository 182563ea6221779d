// One ray through the metaballs of a screen tile, nearest first: the scalar truth of the CPU
// renderer and the body of the GPU's trace kernel.
//
// The tile's list is sorted by `front`, a lower bound of the distance at which any ray enters the
// metaball. The list is worked through in windows: up to the front of the first metaball outside
// the window, the field is the window's alone. Coordinates are taken relative to a point on the ray
// at the window's start, found in double and split into two floats, so that a camera thousands of
// radii away costs no accuracy.
#pragma once

#include <cstdint>

#include "metaball/camera.h"
#include "metaball/color.h"
#include "metaball/first_crossing.h"
#include "metaball/shading.h"
#include "metaball/vec.h"

namespace sherd {

// A point as the unrounded sum of two float vectors.
struct SplitPoint {
  Vec3f high{}, low{};
  SHERD_HD static SplitPoint From(const Vec3d& p) {
    SplitPoint split;
    split.high = p.cast<float>();
    split.low = (p - split.high.cast<double>()).cast<float>();
    return split;
  }
};
SHERD_HD Vec3f Minus(const Vec3f& a, const SplitPoint& b) { return (a - b.high) - b.low; }

// The metaballs one tile may see. Pointers are not owned.
struct TileList {
  const std::uint32_t* metaball = nullptr;  // count indices into the cloud, nearest front first
  int count = 0;
  const float* front = nullptr;   // by cloud index, local units
  const Vec3f* center = nullptr;  // by cloud index
  const float* radius = nullptr;  // by cloud index; null: uniform_radius
  float uniform_radius = 0.0f;    // not yet scaled
  float radius_scale = 1.0f;

  SHERD_HD float RadiusOf(std::uint32_t i) const {
    return (radius ? radius[i] : uniform_radius) * radius_scale;
  }
};

// A crossing, and the window of the list that forms the field there.
struct TileHit {
  bool hit = false;
  double depth = 0.0;      // local units along the ray
  SplitPoint reference;    // the window's origin on the ray
  float t = 0.0f;          // the crossing, from `reference`
  int begin = 0, end = 0;  // list positions whose supports may hold the point
};

struct RayCounts {
  std::uint32_t started_inside = 0, grazing = 0, unresolved = 0;
};

// Bracket in which a crossing is accepted, in radii of the smallest metaball near it: half of what
// the contract allows.
inline constexpr float kDepthTolerance = 5e-5f;
// Metaballs a window takes in at once, and the bound on the steps in one window.
inline constexpr int kWindowSize = 32;
inline constexpr int kMaxStepsPerWindow = 4096;

// The field's bound on a segment of the ray from the metaballs [begin, end) of the list.
struct WindowField {
  const TileList& list;
  SplitPoint reference;
  Vec3f direction;
  int begin, end;

  SHERD_HD void operator()(float t, float dt, FieldBound<float>* bound) const {
    for (int k = begin; k < end; ++k) {
      const std::uint32_t i = list.metaball[k];
      const float inverse_radius = 1.0f / list.RadiusOf(i);
      const RayPass<float> pass =
          PassOf(Minus(list.center[i], reference), direction, inverse_radius);
      if (!(pass.h > 0.0f)) continue;
      const float s0 = t * inverse_radius - pass.b;
      bound->Add(s0, s0 + dt * inverse_radius, pass.h);
    }
  }
};

// The first crossing of `ray` (local units) with the surface of the tile's metaballs.
SHERD_HD TileHit MarchTile(const TileList& list, const RayD& ray, float threshold,
                           RayCounts* counts) {
  TileHit result;
  const Vec3f direction = ray.direction.cast<float>();
  int begin = 0, end = 0;
  double window_start = 0.0;
  bool first = true;
  while (end < list.count) {
    // Take in the next metaballs; the window reaches to the front of the one after them.
    end = end + kWindowSize < list.count ? end + kWindowSize : list.count;
    const double window_end = end < list.count ? static_cast<double>(list.front[list.metaball[end]])
                                               : static_cast<double>(INFINITY);
    if (!(window_end > window_start)) continue;
    if (first) {
      const double front = list.front[list.metaball[0]];
      window_start = front > 0.0 ? front : 0.0;
      first = false;
    }
    // What the ray touches here: the smallest radius, the last exit; metaballs left behind for good
    // are dropped from the front of the window.
    const SplitPoint reference = SplitPoint::From(ray.origin + ray.direction * window_start);
    float smallest = INFINITY, last_exit = 0.0f;
    int touched_begin = end;
    for (int k = begin; k < end; ++k) {
      const std::uint32_t i = list.metaball[k];
      const float r = list.RadiusOf(i);
      const RayPass<float> pass = PassOf(Minus(list.center[i], reference), direction, 1.0f / r);
      if (!(pass.h > 0.0f)) continue;
      const float exit = (pass.b + sqrtf(pass.h)) * r;
      if (!(exit > 0.0f)) continue;
      touched_begin = k < touched_begin ? k : touched_begin;
      smallest = r < smallest ? r : smallest;
      last_exit = exit > last_exit ? exit : last_exit;
    }
    begin = touched_begin;
    if (begin < end) {
      MarchLimits<float> limits;
      const double room = window_end - window_start;
      limits.threshold = threshold;
      limits.t_end = room < static_cast<double>(last_exit) ? static_cast<float>(room) : last_exit;
      // Never finer than the floats along this window.
      const float finest = 4e-7f * limits.t_end;
      limits.tolerance = kDepthTolerance * smallest;
      limits.tolerance = limits.tolerance > finest ? limits.tolerance : finest;
      March<float> march;
      march.dt = 0.5f * smallest < limits.t_end ? 0.5f * smallest : limits.t_end;
      const WindowField field{list, reference, direction, begin, end};
      if (!FindFirstCrossing(field, limits, kMaxStepsPerWindow, &march)) ++counts->unresolved;
      counts->grazing += march.grazing;
      if (march.status == MarchStatus::kHit) {
        result.hit = true;
        result.depth = window_start + static_cast<double>(march.t);
        result.reference = reference;
        result.t = march.t;
        result.begin = begin;
        result.end = end;
        if (!(result.depth > 0.0)) ++counts->started_inside;
        return result;
      }
    }
    window_start = window_end;
  }
  return result;
}

// The depth plane's value for a hit: world units, never 0, which stands for "nothing hit".
SHERD_HD float WorldDepth(double local_depth, double unit) {
  const auto depth = static_cast<float>(local_depth * unit);
  return depth > 1.17549435e-38f ? depth : 1.17549435e-38f;
}

// Sums up the metaballs that form the surface at a hit. colors: by cloud index, sRGB, or null for
// `uniform_color`; srgb_to_linear: 256 values.
SHERD_HD SurfaceSums GatherSurface(const TileList& list, const TileHit& hit, const Vec3f& direction,
                                   const Rgb8* colors, Rgb8 uniform_color,
                                   const float* srgb_to_linear) {
  SurfaceSums sums;
  const Vec3f point = direction * hit.t;
  for (int k = hit.begin; k < hit.end; ++k) {
    const std::uint32_t i = list.metaball[k];
    const Vec3f offset = point - Minus(list.center[i], hit.reference);
    const float r = list.RadiusOf(i);
    if (!(Dot(offset, offset) < r * r)) continue;
    const Rgb8 c = colors ? colors[i] : uniform_color;
    const Vec3f linear{srgb_to_linear[c.r], srgb_to_linear[c.g], srgb_to_linear[c.b]};
    sums.Add(offset, 1.0f / r, linear, static_cast<std::int32_t>(i));
  }
  return sums;
}

}  // namespace sherd
