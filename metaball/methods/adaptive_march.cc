// Steps from the field's value and slope along the ray, to where the tangent reaches the threshold,
// neither longer nor shorter than given; then bisection.
//
// Guarantees: where a pixel is drawn there is a crossing, placed to the tolerance behind its true
// place, whatever the thresholds are. Fails: the tangent says nothing about what begins further on,
// so crossings shorter than the longest step are lost where the field was flat or falling before
// them; it loses more than fixed steps of the same cost where metaballs are sparse, and fewer where
// they are dense.
#include <algorithm>

#include "metaball/methods/ray_method.h"

namespace sherd {
namespace {

// Bounds of a step, in MethodOptions::step.
constexpr double kShortest = 0.125, kLongest = 4.0;
constexpr int kMaxSteps = 100000;

class AdaptiveMarch final : public RayMethod {
 public:
  explicit AdaptiveMarch(const MethodOptions& options) : options_(options) {}

  void Prepare(const MethodSurface&) override {}

  std::optional<double> FirstCrossing(RayField* field, RayCounts* counts) const override {
    double t = 0;
    for (int steps = 0; field->Seek(&t); ++steps) {
      if (steps == kMaxSteps) {
        ++counts->unresolved;
        break;
      }
      const double width = BracketAt(*field, options_.tolerance, t);
      const double unit = options_.step * field->smallest();
      double rate = 0;
      const double excess = field->ExcessAndRate(t, &rate);
      if (steps == 0 && excess >= 0) return t;
      const double reach = rate > 0 ? -excess / rate : kLongest * unit;
      const double next = t + std::max(std::clamp(reach, kShortest * unit, kLongest * unit), width);
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

std::unique_ptr<RayMethod> MakeAdaptiveMarch(const MethodOptions& options) {
  return std::make_unique<AdaptiveMarch>(options);
}

}  // namespace sherd
