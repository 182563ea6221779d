// Ways to intersect a ray with the surface, ours and its rivals, behind one interface: for
// measuring error against time, and for showing why the default is what it is.
//
// The rivals work on the same lists of metaballs a screen tile as our scalar path, in double, a ray
// at a time. They draw surfaces of every ThresholdMode.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "metaball/renderer.h"
#include "metaball/thesis/thesis_renderer.h"

namespace sherd {

enum class Method {
  kOurs,           // the CPU renderer: certified steps (first_crossing.h)
  kThesis,         // the source thesis's octree and marching points (thesis/thesis_renderer.h)
  kFixedMarch,     // equal steps, then bisection (fixed_march.cc)
  kAdaptiveMarch,  // steps from value and slope, then bisection (adaptive_march.cc)
  kSphereTracing,  // steps from a Lipschitz bound (sphere_tracing.cc)
  kInterval,       // bisection by the natural interval bound (interval.cc)
  kPolynomial,     // Bernstein root isolation on every polynomial piece (polynomial.cc)
};

// Lengths are in support radii of the smallest metaball near the place.
struct MethodOptions {
  // Marching: the step, > 0. Adaptive marching takes up to four times as much and down to an
  // eighth of it.
  double step = 0.1;
  // The width of the bracket in which a crossing is accepted; sphere tracing: the step at which it
  // stops. > 0.
  double tolerance = 5e-5;
  // Interval: floats in place of doubles.
  bool single_precision = false;
  // kThesis; its step and tolerance are those above.
  int thesis_depth = ThesisOptions{}.depth;
  bool thesis_gated = ThesisOptions{}.gated;
};

// "ours", "thesis", "fixed-march", "adaptive-march", "sphere-tracing", "interval", "polynomial".
std::string_view NameOf(Method method);
// Throws InputError for another text.
Method ParseMethod(std::string_view text);
std::vector<Method> AllMethods();

// Throws Error for options out of range. The renderer throws Error for a scene the method cannot
// draw: a density that is not polynomial (kPolynomial), one so steep that its first step already
// lies within the tolerance (kSphereTracing).
std::unique_ptr<Renderer> MakeMethodRenderer(Method method, const MethodOptions& options = {});

}  // namespace sherd
