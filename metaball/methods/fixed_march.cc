// Equal steps along the ray, then bisection: the simplest way, and the commonest.
//
// Guarantees: where a pixel is drawn there is a crossing, placed to the tolerance behind its true
// place, whatever the thresholds are: it only evaluates. Fails: a crossing whose stay above the
// threshold is shorter than the step may be stepped over, so that silhouettes lose their rims and
// thin parts vanish, and what is hit lies behind; no step is small enough for all scenes, and time
// grows with its inverse. Metaballs much smaller than others are found by chance only where they
// come into the list after the step over them.
#include "metaball/methods/step_march.h"

namespace sherd {
namespace {

class FixedMarch final : public RayMethod {
 public:
  explicit FixedMarch(const MethodOptions& options) : options_(options) {}

  void Prepare(const MethodSurface&) override {}

  std::optional<double> FirstCrossing(RayField* field, RayCounts* counts) const override {
    return MarchBySteps(field, options_.tolerance, counts,
                        [&](double) { return options_.step * field->smallest(); });
  }

 private:
  MethodOptions options_;
};

}  // namespace

std::unique_ptr<RayMethod> MakeFixedMarch(const MethodOptions& options) {
  return std::make_unique<FixedMarch>(options);
}

}  // namespace sherd
