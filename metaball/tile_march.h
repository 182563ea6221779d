// One ray through the metaballs of a screen tile, nearest first: the scalar truth of the CPU
// renderer.
//
// The tile's list is sorted by `front`, a lower bound of the distance at which any ray enters the
// metaball. The list is worked through in windows: up to the front of the first metaball outside
// the window, the field is the window's alone. Coordinates are taken relative to a point on the ray
// at the window's start, found in double, so that a camera thousands of radii away costs no
// accuracy.
#pragma once

#include <cstdint>

#include "metaball/camera.h"
#include "metaball/color.h"
#include "metaball/first_crossing.h"
#include "metaball/scene.h"
#include "metaball/shading.h"
#include "metaball/tile_entry.h"
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

// A centre relative to a point on the ray, in floats or doubles.
template <class Real>
struct Anchor;
template <>
struct Anchor<float> {
  SplitPoint point;
  SHERD_HD explicit Anchor(const Vec3d& p) : point(SplitPoint::From(p)) {}
  SHERD_HD Vec3f To(const Vec3f& center) const { return Minus(center, point); }
};
template <>
struct Anchor<double> {
  Vec3d point;
  SHERD_HD explicit Anchor(const Vec3d& p) : point(p) {}
  SHERD_HD Vec3d To(const Vec3f& center) const { return center.cast<double>() - point; }
};

// The metaballs one tile may see, nearest front first. Pointers are not owned. Radii are those of
// the supports. The march takes any type with this one's `count`, uniform_threshold,
// threshold_scale and functions (the GPU keeps a list otherwise, cuda/kernels/metaball_list.h).
struct TileList {
  const TileEntry* entry = nullptr;  // `count`, nearest front first
  int count = 0;
  const Vec3f* center = nullptr;     // by cloud index
  const float* radius = nullptr;     // by cloud index; null: uniform_radius
  float uniform_radius = 0.0f;       // not yet scaled
  double radius_scale = 1.0;         // Surface::radius_scale times the density's support
  const float* threshold = nullptr;  // by cloud index; null: uniform_threshold
  double uniform_threshold = 0.7;    // not yet scaled
  double threshold_scale = 1.0;      // 1 / amplitude: shapes have amplitude 1

  SHERD_HD std::uint32_t MetaballAt(int k) const { return entry[k].metaball; }
  SHERD_HD float FrontAt(int k) const { return entry[k].front; }
  SHERD_HD Vec3f CenterOf(std::uint32_t i) const { return center[i]; }
  // Products in Real: doubles see the radii and thresholds that the reference sees.
  template <class Real = float>
  SHERD_HD Real RadiusOf(std::uint32_t i) const {
    return static_cast<Real>(radius ? radius[i] : uniform_radius) * static_cast<Real>(radius_scale);
  }
  template <class Real = float>
  SHERD_HD Real ThresholdOf(std::uint32_t i) const {
    if (!threshold) return static_cast<Real>(uniform_threshold * threshold_scale);
    return static_cast<Real>(threshold[i]) * static_cast<Real>(threshold_scale);
  }
};

// A crossing, and the window of the list that forms the field there.
struct TileHit {
  bool hit = false;
  double depth = 0.0;      // local units along the ray
  SplitPoint reference;    // the crossing
  int begin = 0, end = 0;  // list positions whose supports may hold the point
};

struct RayCounts {
  std::uint32_t started_inside = 0, grazing = 0, unresolved = 0;
  std::uint32_t crowded = 0;  // windows that floats should not have summed up (kFloatOverlap)
};

// Bracket in which a crossing is accepted, in radii of the smallest support near it: half of what
// the contract allows.
inline constexpr float kDepthTolerance = 5e-5f;
// Metaballs a window takes in at once, and the bound on the steps in one window.
inline constexpr int kWindowSize = 32;
inline constexpr int kMaxStepsPerWindow = 4096;
// A bracket is never finer than the numbers along the window: this share of its length.
template <class Real>
inline constexpr Real kFinest = sizeof(Real) == 4 ? Real(4e-7) : Real(8e-16);
// Where the largest radius of a cloud is more than this times the smallest, floats cannot hold the
// large ones' field to the accuracy that the small ones' surface asks for (2^-24 of a field that
// changes over the large radius, against kDepthTolerance of the small one).
inline constexpr float kFloatRadiusRange = 100.0f;

// A sum of n equal floats may be off by n * 2^-26 of itself, and the surface by that over the
// field's relative slope there. Where more metaballs than this overlap on a ray the surface could
// move by more than kDepthTolerance even where the field is well above its flat top
// (docs/accuracy.md): such a tile is traced in doubles.
inline constexpr int kFloatOverlap = 512;

// The part of a tile's list that forms the field on a segment of the ray.
template <class List, class Real, class Shape>
struct Window {
  const List& list;
  const Shape& shape;
  Anchor<Real> anchor;
  Vec3<Real> direction;
  int begin = 0, end = 0;

  struct Pass : RayPass<Real> {
    Real inverse_radius;
    SHERD_HD Real HalfChord() const { return SquareRoot(Real(1) - this->across2); }
    SHERD_HD Real Enter() const { return (this->b - HalfChord()) / inverse_radius; }
    SHERD_HD Real Exit() const { return (this->b + HalfChord()) / inverse_radius; }
  };
  // False where the ray misses the support of list position k.
  SHERD_HD bool PassAt(int k, Pass* pass) const {
    const std::uint32_t i = list.MetaballAt(k);
    pass->inverse_radius = Real(1) / list.template RadiusOf<Real>(i);
    static_cast<RayPass<Real>&>(*pass) =
        PassOf<Real>(anchor.To(list.CenterOf(i)), direction, pass->inverse_radius);
    return pass->across2 < Real(1);
  }
  // Adds every metaball to a bound on [t, t + dt].
  template <class Bound, class... Threshold>
  SHERD_HD void AddTo(Bound* bound, int k, Real t, Real dt, Threshold... threshold) const {
    Pass pass;
    if (!PassAt(k, &pass)) return;
    const Real s0 = t * pass.inverse_radius - pass.b;
    bound->Add(s0, s0 + dt * pass.inverse_radius, pass.across2, threshold...);
  }
};

// Marches through one window from t = 0; `first` is the first segment's length. Returns false when
// steps did not suffice.
template <ThresholdMode kMode, class List, class Real, class Shape>
SHERD_HD bool MarchWindow(const Window<List, Real, Shape>& window, Real first,
                          const MarchLimits<Real>& limits, RayMarch<Real>* march,
                          std::uint32_t* grazing) {
  const List& list = window.list;
  const auto threshold_of = [&](int k) {
    return list.template ThresholdOf<Real>(list.MetaballAt(k));
  };
  const auto begin_march = [&](Real t, Real t_end) {
    *march = {t, Min(first, t_end - t), t_end > t, false};
  };
  begin_march(Real(0), limits.t_end);
  if constexpr (kMode == ThresholdMode::kUniform) {
    const Real threshold = static_cast<Real>(list.uniform_threshold * list.threshold_scale);
    const auto step = [&](RayMarch<Real>* m) {
      TightBound<Real, Shape> bound(window.shape);
      for (int k = window.begin; k < window.end; ++k) window.AddTo(&bound, k, m->t, m->dt);
      return AdvanceUniform(bound.Sum(), threshold, limits, m);
    };
    return RunMarch(step, kMaxStepsPerWindow, march, grazing);
  } else if constexpr (kMode == ThresholdMode::kBlended) {
    Real lowest = Real(INFINITY);
    for (int k = window.begin; k < window.end; ++k) lowest = Min(lowest, threshold_of(k));
    const auto step = [&](RayMarch<Real>* m) {
      BlendedBound<Real, Shape> bound(window.shape);
      for (int k = window.begin; k < window.end; ++k) {
        window.AddTo(&bound, k, m->t, m->dt, threshold_of(k));
      }
      return AdvanceBlended(bound, lowest, limits, m);
    };
    return RunMarch(step, kMaxStepsPerWindow, march, grazing);
  } else if constexpr (kMode == ThresholdMode::kSummed) {
    // From one end of a support to the next the sum of the thresholds is constant.
    Real from = Real(0);
    while (from < limits.t_end) {
      Real until = limits.t_end, threshold = Real(0);
      int active = 0;
      for (int k = window.begin; k < window.end; ++k) {
        typename Window<List, Real, Shape>::Pass pass;
        if (!window.PassAt(k, &pass)) continue;
        const Real enter = pass.Enter(), exit = pass.Exit();
        if (enter > from) until = Min(until, enter);
        if (exit > from) until = Min(until, exit);
        if (!(enter <= from && exit > from)) continue;
        threshold += threshold_of(k);
        ++active;
      }
      if (active > 0) {
        begin_march(from, until);
        const MarchLimits<Real> piece{limits.tolerance, until};
        const auto step = [&](RayMarch<Real>* m) {
          TightBound<Real, Shape> bound(window.shape);
          for (int k = window.begin; k < window.end; ++k) window.AddTo(&bound, k, m->t, m->dt);
          return AdvanceUniform(bound.Sum(), threshold, piece, m);
        };
        if (!RunMarch(step, kMaxStepsPerWindow, march, grazing)) return false;
        if (march->hit) return true;
      }
      from = until;
    }
    return true;
  } else {
    // Each metaball alone; the nearest crossing counts.
    RayMarch<Real> nearest{limits.t_end, Real(0), false, false};
    bool resolved = true;
    for (int k = window.begin; k < window.end; ++k) {
      typename Window<List, Real, Shape>::Pass pass;
      if (!window.PassAt(k, &pass)) continue;
      begin_march(Max(Real(0), pass.Enter()), Min(nearest.t, pass.Exit()));
      const MarchLimits<Real> own{limits.tolerance, Min(nearest.t, pass.Exit())};
      const auto step = [&](RayMarch<Real>* m) {
        TightBound<Real, Shape> bound(window.shape);
        window.AddTo(&bound, k, m->t, m->dt);
        return AdvanceUniform(bound.Sum(), threshold_of(k), own, m);
      };
      resolved = RunMarch(step, kMaxStepsPerWindow, march, grazing) && resolved;
      if (march->hit) nearest = *march;
    }
    *march = nearest;
    return resolved;
  }
}

// The first crossing of `ray` (local units) with the surface of the tile's metaballs.
template <ThresholdMode kMode, class Real, class List, class Shape>
SHERD_HD TileHit MarchTile(const List& list, const Shape& shape, const RayD& ray,
                           RayCounts* counts) {
  TileHit result;
  int begin = 0, end = 0;
  double window_start = 0.0;
  bool first = true;
  while (end < list.count) {
    // Take in the next metaballs; the window reaches to the front of the one after them.
    end = end + kWindowSize < list.count ? end + kWindowSize : list.count;
    const double window_end =
        end < list.count ? static_cast<double>(list.FrontAt(end)) : static_cast<double>(INFINITY);
    if (!(window_end > window_start)) continue;
    if (first) {
      const double front = list.FrontAt(0);
      window_start = front > 0.0 ? front : 0.0;
      first = false;
    }
    // What the ray touches here: the smallest radius, the last exit; metaballs left behind for good
    // are dropped from the front of the window.
    Window<List, Real, Shape> window{list, shape,
                                     Anchor<Real>(ray.origin + ray.direction * window_start),
                                     ray.direction.cast<Real>()};
    Real smallest = Real(INFINITY), last_exit = Real(0);
    int touched_begin = end, touched = 0;
    for (int k = begin; k < end; ++k) {
      typename Window<List, Real, Shape>::Pass pass;
      if (!window.PassAt(k, &pass)) continue;
      const Real exit = pass.Exit();
      if (!(exit > Real(0))) continue;
      touched_begin = k < touched_begin ? k : touched_begin;
      ++touched;
      smallest = Min(smallest, Real(1) / pass.inverse_radius);
      last_exit = Max(last_exit, exit);
    }
    begin = touched_begin;
    if (sizeof(Real) == 4 && touched > kFloatOverlap) ++counts->crowded;
    if (begin < end) {
      window.begin = begin;
      window.end = end;
      MarchLimits<Real> limits;
      const double room = window_end - window_start;
      limits.t_end = room < static_cast<double>(last_exit) ? static_cast<Real>(room) : last_exit;
      limits.tolerance =
          Max(static_cast<Real>(kDepthTolerance) * smallest, kFinest<Real> * limits.t_end);
      RayMarch<Real> march;
      if (!MarchWindow<kMode>(window, static_cast<Real>(kFirstSegment) * smallest, limits, &march,
                              &counts->grazing)) {
        ++counts->unresolved;
      }
      if (march.hit) {
        result.hit = true;
        result.depth = window_start + static_cast<double>(march.t);
        result.reference = SplitPoint::From(ray.origin + ray.direction * result.depth);
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

// Sums up the metaballs that form the surface at a hit. color_of(i): metaball i's, linear light.
template <ThresholdMode kMode, class List, class Shape, class ColorOf>
SHERD_HD SurfaceSums GatherSurface(const List& list, const Shape& shape, const TileHit& hit,
                                   const ColorOf& color_of) {
  SurfaceSums sums;
  float highest = -INFINITY;
  for (int k = hit.begin; k < hit.end; ++k) {
    const std::uint32_t i = list.MetaballAt(k);
    const Vec3f offset = -Minus(list.CenterOf(i), hit.reference);
    const float inverse_r = 1.0f / list.RadiusOf(i), inverse_r2 = inverse_r * inverse_r;
    const float u = Dot(offset * inverse_r, offset * inverse_r);
    if (!(u < 1.0f)) continue;
    const float f = shape.Value(u), slope = shape.Slope(u);
    if constexpr (kMode == ThresholdMode::kGated) {
      // The metaball whose sphere this is.
      if (!(f - list.ThresholdOf(i) > highest)) continue;
      highest = f - list.ThresholdOf(i);
      sums = {};
    }
    sums.Add(offset, f, slope, inverse_r2, color_of(i), static_cast<std::int32_t>(i));
    if constexpr (kMode == ThresholdMode::kBlended) {
      sums.AddThreshold(offset, slope, inverse_r2, list.ThresholdOf(i));
    }
  }
  return sums;
}

}  // namespace sherd
