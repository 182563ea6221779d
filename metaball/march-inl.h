// No guard: see density/shapes.h.
//
// The first crossing F = threshold along a ray, by certified steps.
//
// A march keeps a point t with F < threshold everywhere before it. It asks for an upper bound of F
// on [t, t + dt] in Bernstein form (density/bounds-inl.h). The bound starts at F(t) exactly; the
// steepest line from there through another control point lies above the whole bound, so F stays
// below the threshold at least up to where that line reaches it: the march moves there. Where the
// bound stays below, the whole segment is free. Near a crossing the bound is nearly linear and the
// steps converge quadratically. A crossing is accepted when it is certain (F >= threshold at the
// segment's end) and its place is known to within `tolerance`. Nothing is ever stepped over but
// what rises above the threshold for less than `tolerance` of path (grazing), and each such place
// is counted.

// The first segment of a march, in radii of the smallest support.
inline constexpr double kFirstSegment = 0.75;
// A step that could not pass shortens the next segment at least by this factor.
inline constexpr double kRefineShrink = 0.6;
// How many lines are followed on one bound: the second saves a tenth of the bounds, a third
// nothing.
inline constexpr int kLinesPerStep = 2;
// The share of a step's length by which the next segment reaches beyond the bound's crossing.
inline constexpr double kDoubt = 0.3;

// What a march is for: the first crossing, or only whether there is one.
enum class MarchGoal { kFirst, kAny };

template <class T, class Mask>
struct March {
  T t, dt;
  Mask searching;  // nothing found yet and t < t_end
  Mask hit;        // the crossing is at t
};

// What governs the steps. All lengths in the same units as t.
template <class T>
struct MarchLimits {
  T tolerance;  // > 0: width of the bracket in which a crossing is accepted
  T t_end;      // the segment for which the bound is valid ends here
};

// The line from a bound's start through its control points that rises most, over the segment.
template <class T, int N>
SHERD_FORMULA T SteepestRise(const Bernstein<T, N>& bound) {
  T steepest = T(N) * (bound.c[1] - bound.c[0]);
  for (int k = 2; k <= N; ++k) {
    steepest = Max(steepest, T(static_cast<double>(N) / k) * (bound.c[k] - bound.c[0]));
  }
  return steepest;
}

// The part of a polynomial on [u, 1], in Bernstein form over that part (de Casteljau).
template <class T, int N>
SHERD_FORMULA Bernstein<T, N> RightPart(Bernstein<T, N> p, T u) {
  for (int level = N; level > 0; --level) {
    for (int i = 0; i < level; ++i) p.c[i] = p.c[i] + u * (p.c[i + 1] - p.c[i]);
  }
  return p;
}

// One step of the march from the bound on [t, t + dt], where dt > 0 and t + dt <= t_end.
// at_start: the crossing is reached at t; certain: F >= threshold at t + dt. Returns where a rise
// was passed that is too short to matter.
template <class T, int N, class Mask>
SHERD_FORMULA Mask AdvanceMarch(const Bernstein<T, N>& bound, T threshold, Mask at_start,
                                Mask certain, const MarchLimits<T>& limits, March<T, Mask>* march) {
  const T one = T(1), zero = T(0);
  const T t = march->t, dt = march->dt;
  // Where the bound reaches the threshold, approached from below: each line's crossing is where the
  // rest of the bound begins. Far cheaper than another bound of the field.
  Bernstein<T, N> rest = bound;
  T room = one;
  Mask blocked = bound.c[0] >= bound.c[0];
  for (int k = 0; k < kLinesPerStep; ++k) {
    const T rise = Max(threshold - rest.c[0], zero);
    const T steepest = SteepestRise(rest);
    blocked = Both(blocked, steepest >= rise);
    const T u = Where(blocked, rise / Where(steepest > zero, steepest, one), one);
    rest = RightPart(rest, u);
    room = room * (one - u);
  }
  const T u = one - room;
  const Mask accepted = Both(Both(blocked, certain), room * dt <= limits.tolerance);
  const Mask open = Both(blocked, Not(accepted));
  const Mask grazing = Both(open, dt <= limits.tolerance);
  const Mask refine = Both(open, Not(grazing));

  // Aim the next segment's end just past where Newton's step on the bound puts the crossing and as
  // far as this step has shown the bound to be off; always shorter than before: where the bound is
  // far above the field, only that helps.
  const T slope = T(N) * (rest.c[1] - rest.c[0]);
  const Mask rising = slope > zero;
  const T newton = Where(rising, (threshold - rest.c[0]) / Where(rising, slope, one), one) * room;
  const T reach = Max(Min(newton, room), zero);
  const T wanted = (T(1.125) * reach + T(kDoubt) * u) * dt + T(0.5) * limits.tolerance;
  const T refined_dt = Min(wanted, T(kRefineShrink) * dt);

  // Inside the accepted bracket the field is linear to far below the tolerance.
  const T secant = (threshold - bound.c[0]) / Where(accepted, bound.c[N] - bound.c[0], one);
  const T step = Where(accepted, Min(Max(secant, u), one), Where(refine, u, one));
  const Mask found = Both(march->searching, Either(at_start, accepted));
  const T moved = Where(at_start, t, t + step * dt);
  march->t = Where(march->searching, moved, t);
  march->hit = Either(march->hit, found);
  march->searching = Both(march->searching, Not(found));
  const Mask passed = Both(grazing, march->searching);
  const T left = limits.t_end - march->t;
  march->searching = Both(march->searching, left > zero);
  march->dt = Min(Where(refine, refined_dt, T(2) * dt), left);
  return passed;
}

// One step where one threshold holds (thesis 2.8). With MarchGoal::kAny there is a hit as soon as
// the far end of a segment lies inside, wherever the crossing is.
template <MarchGoal kGoal = MarchGoal::kFirst, class T, int N, class Mask>
SHERD_FORMULA Mask AdvanceUniform(const Bernstein<T, N>& bound, T threshold,
                                  const MarchLimits<T>& limits, March<T, Mask>* march) {
  const Mask starts_inside = bound.c[0] >= threshold, ends_inside = bound.c[N] >= threshold;
  const Mask found = kGoal == MarchGoal::kAny ? Either(starts_inside, ends_inside) : starts_inside;
  return AdvanceMarch(bound, threshold, found, ends_inside, limits, march);
}

// One step with blended thresholds (ThresholdMode::kBlended), from the two bounds of a
// BlendedBound. `lowest` is the least threshold of
// the metaballs in reach: no crossing lies where sum f < lowest, and that bound leads where it
// passes more; elsewhere the excess does. kGoal as above.
template <MarchGoal kGoal = MarchGoal::kFirst, class T, class Mask>
SHERD_FORMULA Mask AdvanceBlended(const Bernstein<T, 4>& excess, Bernstein<T, 4> weight, T lowest,
                                  const MarchLimits<T>& limits, March<T, Mask>* march) {
  const T zero = T(0);
  for (int k = 0; k <= 4; ++k) weight.c[k] = weight.c[k] - lowest;
  const Mask at_start = Both(weight.c[0] >= zero, excess.c[0] >= zero);
  const Mask certain = Both(weight.c[4] >= zero, excess.c[4] >= zero);
  // How far each passes: rise / steepest, compared crosswise. One that is above at its start passes
  // nothing.
  const T weight_rise = zero - weight.c[0], weight_steepest = SteepestRise(weight);
  const T excess_rise = zero - excess.c[0], excess_steepest = SteepestRise(excess);
  const T tiny = T(1e-30);
  const T weight_passes = Max(weight_rise, zero) / Max(weight_steepest, tiny);
  const T excess_passes = Max(excess_rise, zero) / Max(excess_steepest, tiny);
  const Mask weight_leads = weight_passes > excess_passes;
  Bernstein<T, 4> leading;
  for (int k = 0; k <= 4; ++k) leading.c[k] = Where(weight_leads, weight.c[k], excess.c[k]);
  const Mask found = kGoal == MarchGoal::kAny ? Either(at_start, certain) : at_start;
  return AdvanceMarch(leading, zero, found, certain, limits, march);
}
template <MarchGoal kGoal = MarchGoal::kFirst, class T, class Mask, class Shape>
SHERD_FORMULA Mask AdvanceBlended(const BlendedBound<T, Shape>& sums, T lowest,
                                  const MarchLimits<T>& limits, March<T, Mask>* march) {
  return AdvanceBlended<kGoal>(sums.Excess(), sums.Weight(), lowest, limits, march);
}
