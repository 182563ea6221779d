// Equal steps along the ray, then bisection: the simplest way, and the commonest.
//
// Guarantees: where a pixel is drawn there is a crossing, placed to the tolerance behind its true
// place, whatever the thresholds are: it only evaluates. Fails: a crossing whose stay above the
// threshold is shorter than the step may be stepped over, so that silhouettes lose their rims and
// thin parts vanish, and what is hit lies behind; no step is small enough for all scenes, and time
// grows with its inverse. Metaballs much smaller than others are found by chance only where they
// come into the list after the step over them.
#include <algorithm>

#include "metaball/methods/ray_method.h"

namespace sherd {
namespace {

constexpr int kMaxSteps = 100000;

class FixedMarch final : public RayMethod {
 public:
  explicit FixedMarch(const MethodOptions& options) : options_(options) {}

  void Prepare(const MethodSurface&) override {}

  std::optional<double> FirstCrossing(RayField* field, RayCounts* counts) const override {
    double t = 0;
    for (int steps = 0; field->Seek(&t); ++steps) {
      if (steps == kMaxSteps) {
        ++counts->unresolved;
        break;
      }
      if (steps == 0 && field->Excess(t) >= 0) return t;
      const double width = BracketAt(*field, options_.tolerance, t);
      const double next = t + std::max(options_.step * field->smallest(), width);
      field->Cover(next);
      if (field->Excess(next) >= 0) return Bisect(*field, t, next, width);
      t = next;
    }
    return std::nullopt;
  }

 private:
  MethodOptions options_;
};

}  // namespace

std::unique_ptr<RayMethod> MakeFixedMarch(const MethodOptions& options) {
  return std::make_unique<FixedMarch>(options);
}

}  // namespace sherd
