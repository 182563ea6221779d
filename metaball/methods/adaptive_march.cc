// Steps from the field's value and slope along the ray, to where the tangent reaches the threshold,
// neither longer nor shorter than given; then bisection.
//
// Guarantees: where a pixel is drawn there is a crossing, placed to the tolerance behind its true
// place, whatever the thresholds are. Fails: the tangent says nothing about what begins further on,
// so crossings shorter than the longest step are lost where the field was flat or falling before
// them; it loses more than fixed steps of the same cost where metaballs are sparse, and fewer where
// they are dense.
#include <algorithm>

#include "metaball/methods/step_march.h"

namespace sherd {
namespace {

// Bounds of a step, in MethodOptions::step.
constexpr double kShortest = 0.125, kLongest = 4.0;

class AdaptiveMarch final : public RayMethod {
 public:
  explicit AdaptiveMarch(const MethodOptions& options) : options_(options) {}

  void Prepare(const MethodSurface&) override {}

  std::optional<double> FirstCrossing(RayField* field, RayCounts* counts) const override {
    return MarchBySteps(field, options_.tolerance, counts, [&](double t) {
      const double unit = options_.step * field->smallest();
      double rate = 0;
      const double excess = field->ExcessAndRate(t, &rate);
      const double reach = rate > 0 ? -excess / rate : kLongest * unit;
      return std::clamp(reach, kShortest * unit, kLongest * unit);
    });
  }

 private:
  MethodOptions options_;
};

}  // namespace

std::unique_ptr<RayMethod> MakeAdaptiveMarch(const MethodOptions& options) {
  return std::make_unique<AdaptiveMarch>(options);
}

}  // namespace sherd
