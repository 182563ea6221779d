// The march of the methods that only look: step after step, then bisection.
#pragma once

#include <algorithm>
#include <optional>

#include "metaball/methods/ray_method.h"

namespace sherd {

// step_at(t): how long the step from t is, local units; never shorter than the bracket to which
// `tolerance` (radii) narrows a crossing.
template <class StepAt>
std::optional<double> MarchBySteps(RayField* field, double tolerance, RayCounts* counts,
                                   const StepAt& step_at) {
  double t = 0;
  for (int steps = 0; field->Seek(&t); ++steps) {
    if (steps == kMaxSteps) {
      ++counts->unresolved;
      break;
    }
    if (steps == 0 && field->Excess(t) >= 0) return t;
    const double width = BracketAt(*field, tolerance, t);
    const double next = t + std::max(step_at(t), width);
    field->Cover(next);
    if (field->Excess(next) >= 0) return Bisect(*field, t, next, width);
    t = next;
  }
  return std::nullopt;
}

}  // namespace sherd
