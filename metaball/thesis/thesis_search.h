// One ray through the thesis's octree (thesis_renderer.h), and the rules where the thesis leaves
// them open:
// - Marching runs from the first support's beginning to the last one's end, of the metaballs the
//   node has found, inside the node and outside.
// - The step follows Singh and Narayanan's two measures: it shortens with the field's distance from
//   the threshold and where the ray runs along the surface (kNear, kHorizon below). A change of
//   sign between two points is narrowed by bisection.
//
// Written once for the CPU and the GPU, for double and float.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "metaball/hostdevice.h"
#include "metaball/methods/hit_pixel.h"
#include "metaball/methods/ray_metaball.h"
#include "metaball/scene.h"
#include "metaball/thesis/octree_view.h"
#include "metaball/thesis/octree_walk.h"
#include "metaball/tile_march.h"
#include "metaball/vec.h"

namespace sherd {

// A density over its support, by u = (distance / support radius)^2. Shape: one of shapes.h.
template <class Real, class Shape>
struct ThesisDensity {
  Shape shape;
  Real amplitude = Real(1);

  SHERD_HD Real Value(Real u) const { return u < Real(1) ? amplitude * shape.Value(u) : Real(0); }
  // d Value / d u, u < 1.
  SHERD_HD Real Slope(Real u) const { return amplitude * shape.Slope(u); }

  // u at which a density that falls outwards reaches the threshold; -1 where it never does.
  SHERD_HD Real IsoOf(Real threshold) const {
    if (!(Value(Real(0)) >= threshold)) return Real(-1);
    Real inside = Real(0), outside = Real(1);
    for (int i = 0; i < 60; ++i) {
      const Real middle = Real(0.5) * (inside + outside);
      (Value(middle) >= threshold ? inside : outside) = middle;
    }
    return inside;
  }
};

// What all rays of a frame share.
template <class Real>
struct ThesisRules {
  bool gated = true;     // thresholds are gated, else as `mode` says
  bool monotone = true;  // the density falls from the centre outwards
  ThresholdMode mode = ThresholdMode::kUniform;
  Real threshold = Real(0);                        // the surface's
  Real uniform_iso = Real(-1);                     // IsoOf the surface's threshold
  Real radius_scale = Real(1), support = Real(1);  // a support's radius over its metaball's
  Real step = Real(0), tolerance = Real(0);        // ThesisOptions
};

// A metaball that the ray meets, as a node has taken it: read two numbers at a time. kOwn: radii or
// thresholds differ.
template <class Real, bool kOwn>
struct alignas(2 * sizeof(Real)) ThesisTaken {
  Real b, miss;         // as in RayMetaball
  Vec3<Real> across;    // from the ray's closest approach to the centre
  std::uint32_t place;  // in the octree's list
  Real inverse_radius, threshold;
};
template <class Real>
struct alignas(2 * sizeof(Real)) ThesisTaken<Real, false> {
  Real b, miss;
  Vec3<Real> across;
  std::uint32_t place;
};

// The search of one ray after another; one object a thread.
//
// Metaballs, by places in the octree's lists:
//   kOwn               whether radii or thresholds differ
//   Read(place)        an object with center() (Vec3f) and radius, local units
//   ThresholdOf(place, otherwise)   its own, or the surface's
//   IndexOf(place), LinearColorOf(place)
// Store keeps what a node takes: Set(k, taken), operator[](k) for k < kRoom. Where a node takes
// more, the rest is read from the octree's lists whenever it is needed, with equal results.
template <class Real, class Shape, class Metaballs, class Store>
class ThesisSearch {
 public:
  using Taken = ThesisTaken<Real, Metaballs::kOwn>;

  // What is given by reference must outlive the search.
  SHERD_HD ThesisSearch(const OctreeView<Real>& octree, const Metaballs& metaballs,
                        const ThesisDensity<Real, Shape>& density, const ThesisRules<Real>& rules,
                        Store* store)
      : octree_(&octree),
        metaballs_(&metaballs),
        density_(&density),
        rules_(&rules),
        store_(store) {}

  // The depth of the crossing that ends the search, local units along the ray; < 0: there is none.
  // direction: of unit length.
  SHERD_HD Real Trace(const Vec3<Real>& origin, const Vec3<Real>& direction, RayCounts* counts) {
    origin_ = origin;
    direction_ = direction;
    for (OctreeWalk<Real> walk(*octree_, origin, direction); walk.inside(); walk.Step()) {
      if (!walk.near()) continue;
      TakeNear(walk.node());
      const Real depth = SearchNode(counts);
      if (depth >= Real(0)) return depth;
    }
    return Real(-1);
  }

  // The metaballs at the crossing that Trace has just found.
  SHERD_HD BasicHitSums<Real> Gather(Real depth) const {
    const Vec3<Real> point = origin_ + direction_ * depth;
    BasicHitSums<Real> sums;
    // Of a gated sum those above their thresholds; all where rounding leaves none.
    for (int pass = rules_->gated ? 0 : 1; pass < 2; ++pass) {
      ForEachTaken([&](const Taken& taken) {
        const Real u = UAt(taken, depth);
        if (!(u < Real(1))) return;
        const Real f = density_->Value(u);
        if (pass == 0 && !(f >= ThresholdOf(taken))) return;
        const Vec3<Real> offset =
            point - metaballs_->Read(taken.place).center().template cast<Real>();
        // Directions weighted by influence (thesis 3.5).
        sums.Add(metaballs_->LinearColorOf(taken.place), metaballs_->IndexOf(taken.place), f,
                 Normalized(offset, Vec3<Real>{}) * f);
      });
      if (sums.strongest_idx >= 0) break;
    }
    return sums;
  }

 private:
  // The step is multiplied by twice the field's distance from the threshold, relative to the
  // threshold, within these bounds; and by kHorizon where the ray runs along the surface, rising to
  // 1 where it meets it squarely.
  static constexpr Real kNear = Real(0.25), kFar = Real(2), kHorizon = Real(0.5);
  static constexpr int kMaxSteps = 100000;
  // What the numbers can tell apart, as a share of the depth.
  static constexpr Real kFinestStep = sizeof(Real) == 8 ? Real(1e-14) : Real(5e-7);

  struct Sample {
    Real level;    // the surface is where this becomes positive; >= -rules.threshold
    Real horizon;  // the cosine between the ray and the field's gradient, without sign
  };

  SHERD_HD Real InverseOf(const Taken& taken) const {
    if constexpr (Metaballs::kOwn) {
      return taken.inverse_radius;
    } else {
      return inverse_radius_;
    }
  }
  SHERD_HD Real ThresholdOf(const Taken& taken) const {
    if constexpr (Metaballs::kOwn) {
      return taken.threshold;
    } else {
      return rules_->threshold;
    }
  }
  SHERD_HD Real UAt(const Taken& taken, Real t) const {
    const Real s = (t - taken.b) * InverseOf(taken);
    return taken.miss + s * s;
  }

  // Whether the ray meets the metaball at a place of the octree's lists: the sphere test.
  SHERD_HD bool Meet(std::uint32_t place, BasicRayMetaball<Real>* met, Taken* taken) const {
    const auto metaball = metaballs_->Read(place);
    const Vec3<Real> to_center = metaball.center().template cast<Real>() - origin_;
    const Real support =
        static_cast<Real>(metaball.radius) * rules_->radius_scale * rules_->support;
    if (!MeetMetaball(to_center, direction_, support, place, met)) return false;
    taken->b = met->b;
    taken->miss = met->miss;
    taken->across = to_center - direction_ * met->b;
    taken->place = place;
    if constexpr (Metaballs::kOwn) {
      taken->inverse_radius = met->inverse_radius;
      taken->threshold = metaballs_->ThresholdOf(place, rules_->threshold);
    }
    return true;
  }

  SHERD_HD void TakeNear(std::uint32_t node) {
    node_ = node;
    count_ = 0;
    overfull_ = false;
    begin_ = Real(INFINITY);
    end_ = steepest_ = Real(0);
    ForEachNear(*octree_, node, {}, [&](const NearPlace& at) {
      BasicRayMetaball<Real> met;
      Taken taken;
      if (!Meet(at.place, &met, &taken)) return;
      begin_ = Min(met.enter, begin_);
      end_ = Max(met.exit, end_);
      steepest_ = Max(met.inverse_radius, steepest_);
      if (count_ < Store::kRoom) {
        store_->Set(count_++, taken);
      } else if (!overfull_) {
        overfull_ = true;
        rest_ = at;
      }
    });
    inverse_radius_ = steepest_;
  }

  template <class F>
  SHERD_HD void ForEachTaken(const F& f) const {
    for (std::uint32_t k = 0; k < count_; ++k) f((*store_)[k]);
    if (!overfull_) return;
    ForEachNear(*octree_, node_, rest_, [&](const NearPlace& at) {
      BasicRayMetaball<Real> met;
      Taken taken;
      if (Meet(at.place, &met, &taken)) f(taken);
    });
  }

  SHERD_HD Real SearchNode(RayCounts* counts) const {
    if (count_ == 0) return Real(-1);
    // In the lobes of a cosine there is more than one sphere to solve for.
    if (count_ == 1 && rules_->monotone) return SolveLone((*store_)[0]);
    return rules_->gated ? March<true>(counts) : March<false>(counts);
  }

  SHERD_HD Real SolveLone(const Taken& taken) const {
    const Real threshold = ThresholdOf(taken);
    const Real iso =
        threshold == rules_->threshold ? rules_->uniform_iso : density_->IsoOf(threshold);
    const Real root2 = iso - taken.miss;
    if (!(root2 >= Real(0))) return Real(-1);
    const Real half = SquareRoot(root2) / InverseOf(taken);
    if (taken.b + half < Real(0)) return Real(-1);
    return Max(Real(0), taken.b - half);
  }

  template <bool kGated>
  SHERD_HD Real March(RayCounts* counts) const {
    const Real smallest = Real(1) / steepest_;
    const Real base = rules_->step * smallest;
    const Real width = Max(rules_->tolerance * smallest, kFinestStep * end_);
    Real t = Max(Real(0), begin_), before = t;
    for (int steps = 0;; ++steps) {
      const Sample here = At<kGated, true>(t);
      if (here.level >= Real(0)) return steps == 0 ? t : Narrow<kGated>(before, t, width);
      if (!(t < end_)) return Real(-1);
      if (steps == kMaxSteps) {
        ++counts->unresolved;
        return Real(-1);
      }
      const Real near = -here.level / rules_->threshold;
      const Real along = kHorizon + (Real(1) - kHorizon) * here.horizon;
      before = t;
      // Never less than the numbers can tell apart, however far the camera.
      t += Max(base * Min(Max(2 * near, kNear), kFar) * along, width);
    }
  }

  // Bisects between a place outside and one inside.
  template <bool kGated>
  SHERD_HD Real Narrow(Real outside, Real inside, Real width) const {
    while (inside - outside > width) {
      const Real middle = Real(0.5) * (outside + inside);
      (At<kGated, false>(middle).level >= Real(0) ? inside : outside) = middle;
    }
    return inside;
  }

  // The horizon only where it is asked for.
  template <bool kGated, bool kHorizonToo>
  SHERD_HD Sample At(Real t) const {
    const Real nothing = -rules_->threshold;
    Real sum = 0, weighted = 0, over = 0, added = 0, highest = nothing;
    Real along = 0;
    Vec3<Real> across{};
    bool held = false;
    ForEachTaken([&](const Taken& taken) {
      const Real inverse = InverseOf(taken);
      const Real u = UAt(taken, t);
      if (!(u < Real(1))) return;
      held = true;
      const Real f = density_->Value(u);
      const Real threshold = ThresholdOf(taken);
      const Real above = f - threshold;
      if constexpr (kGated) {
        if (above > Real(0)) added += above;
        highest = Max(above, highest);
      } else {
        sum += f;
        weighted += f * threshold;
        over += above;
      }
      if constexpr (kHorizonToo) {
        const Real slope = density_->Slope(u);
        along += slope * (2 * (t - taken.b) * inverse * inverse);
        // The point minus the centre, without its part along the ray.
        across += taken.across * (-2 * slope * inverse * inverse);
      }
    });
    Sample sample{nothing, Real(1)};
    if (held) {
      if constexpr (kGated) {
        // Only what is positive is added (algorithms 2-6); below, what is nearest to being so.
        sample.level = highest >= Real(0) ? added : highest;
      } else if (rules_->mode == ThresholdMode::kUniform) {
        sample.level = sum - rules_->threshold;
      } else if (rules_->mode == ThresholdMode::kBlended) {
        sample.level = sum > Real(0) ? sum - weighted / sum : nothing;
      } else {
        sample.level = over;
      }
    }
    if constexpr (kHorizonToo) {
      const Real length = SquareRoot(along * along + Dot(across, across));
      if (length > Real(0) && length < Real(INFINITY)) {
        sample.horizon = (along < Real(0) ? -along : along) / length;
      }
    }
    return sample;
  }

  const OctreeView<Real>* octree_;
  const Metaballs* metaballs_;
  const ThesisDensity<Real, Shape>* density_;
  const ThesisRules<Real>* rules_;
  Store* store_;
  Vec3<Real> origin_{}, direction_{};
  // Of the node that was taken last.
  std::uint32_t node_ = kOctreeOutside;
  std::uint32_t count_ = 0;  // of what the store holds
  bool overfull_ = false;    // there is more
  NearPlace rest_;           // from here on in the lists
  Real begin_ = 0, end_ = 0,
       steepest_ = 0;        // of the supports: first entry, last exit, 1 / smallest
  Real inverse_radius_ = 0;  // where all are equal
};

}  // namespace sherd
