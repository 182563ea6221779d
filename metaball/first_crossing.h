// The first crossing F = threshold along a ray, by certified steps.
//
// A march keeps a point t with F < threshold everywhere before it. It asks for the Bernstein bound
// of F on [t, t + dt] (density.h). The bound starts at F(t) exactly; the steepest line from there
// through another control point lies above the whole bound, so F stays below the threshold at least
// up to where that line reaches it: the march moves there. Where the bound stays below, the whole
// segment is free. Near a crossing the bound is nearly linear and the steps converge quadratically.
// A crossing is accepted when it is certain (F >= threshold at the segment's end) and its place is
// known to within `tolerance`. Nothing is ever stepped over but what rises above the threshold for
// less than `tolerance` of path (grazing), and each such place is counted.
#pragma once

#include <cstdint>

#include "metaball/density.h"
#include "metaball/hostdevice.h"

namespace sherd {

enum class MarchStatus : std::uint8_t {
  kSearching,  // nothing found yet, t moved
  kHit,        // the crossing is at t
  kExhausted,  // t reached t_end without a crossing
};

// A step that could not pass shortens the next segment at least by this factor.
inline constexpr double kRefineShrink = 0.6;

template <class T>
struct March {
  T t = T(0);
  T dt = T(0);
  MarchStatus status = MarchStatus::kSearching;
  std::uint32_t grazing = 0;
};

// What governs the steps. All lengths in the same units as t.
template <class T>
struct MarchLimits {
  T threshold;
  T tolerance;  // > 0: width of the bracket in which a crossing is accepted
  T t_end;      // the segment for which the bound is valid ends here
};

// The bound's polynomial and its slope at u in [0, 1] (de Casteljau).
template <class T>
SHERD_HD void EvaluateBound(const FieldBound<T>& bound, T u, T* value, T* slope) {
  T p[5] = {bound.c[0], bound.c[1], bound.c[2], bound.c[3], bound.c[4]};
  for (int level = 4; level > 1; --level) {
    for (int i = 0; i < level; ++i) p[i] += u * (p[i + 1] - p[i]);
  }
  *slope = T(4) * (p[1] - p[0]);
  *value = p[0] + u * (p[1] - p[0]);
}

// One step of the march from the bound on [t, t + dt], where dt > 0 and t + dt <= t_end.
template <class T>
SHERD_HD void AdvanceMarch(const FieldBound<T>& bound, const MarchLimits<T>& limits,
                           March<T>* march) {
  const T threshold = limits.threshold;
  const T c0 = bound.c[0];
  if (c0 >= threshold) {
    march->status = MarchStatus::kHit;
    return;
  }
  T steepest = T(4) * (bound.c[1] - c0);
  T other = T(2) * (bound.c[2] - c0);
  steepest = other > steepest ? other : steepest;
  other = T(4.0 / 3.0) * (bound.c[3] - c0);
  steepest = other > steepest ? other : steepest;
  other = bound.c[4] - c0;
  steepest = other > steepest ? other : steepest;

  const T rise = threshold - c0;
  const bool certain = bound.c[4] >= threshold;
  if (!(steepest >= rise)) {  // the whole segment is free
    march->t += march->dt;
    march->dt *= T(2);
  } else {
    const T u = rise / steepest;
    const T left = (T(1) - u) * march->dt;
    if (certain && left <= limits.tolerance) {
      // Inside the bracket the field is linear to far below the tolerance.
      const T v = rise / (bound.c[4] - c0);
      march->t += march->dt * (v > u ? v : u);
      march->status = MarchStatus::kHit;
      return;
    }
    if (march->dt <= limits.tolerance) {  // not certain: a rise too short to matter
      ++march->grazing;
      march->t += march->dt;
      march->dt *= T(2);
    } else {
      // Aim the next segment's end just past where Newton's step puts the crossing.
      T value, slope;
      EvaluateBound(bound, u, &value, &slope);
      const T gap = threshold - value;
      T reach = slope > T(0) ? gap / slope : T(1);
      const T room = T(1) - u;
      reach = reach < room ? reach : room;
      reach = reach > T(0) ? reach : T(0);
      march->t += u * march->dt;
      // Always shorter than before: where the bound is far above the field, only that helps.
      const T wanted = T(1.125) * reach * march->dt + T(0.5) * limits.tolerance;
      const T longest = T(kRefineShrink) * march->dt;
      march->dt = wanted < longest ? wanted : longest;
    }
  }
  const T rest = limits.t_end - march->t;
  if (!(rest > T(0))) {
    march->status = MarchStatus::kExhausted;
    return;
  }
  march->dt = march->dt < rest ? march->dt : rest;
}

// Runs a march to its end on [march->t, limits.t_end]. `accumulate(t, dt, &bound)` adds every
// metaball whose support may meet [t, t + dt]. Returns false when `max_steps` did not suffice (to
// be counted by the caller; never silent).
template <class T, class Accumulate>
SHERD_HD bool FindFirstCrossing(const Accumulate& accumulate, const MarchLimits<T>& limits,
                                int max_steps, March<T>* march) {
  for (int step = 0; step < max_steps; ++step) {
    if (march->status != MarchStatus::kSearching) return true;
    FieldBound<T> bound;
    accumulate(march->t, march->dt, &bound);
    AdvanceMarch(bound, limits, march);
  }
  return march->status != MarchStatus::kSearching;
}

}  // namespace sherd
