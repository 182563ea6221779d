// Sphere tracing (Hart 1996): the field cannot change faster than a Lipschitz bound L allows, so
// the ray is free for (T - F) / L. L is the sum of the densities' steepest slopes over the
// metaballs that meet the next stretch of the ray, and the step ends with that stretch.
//
// With thresholds of each metaball, A = sum f, l_k a metaball's steepest slope and L = sum l_k:
//   blended  free as far as A + L d stays below the least threshold, or (A + L d)^2 below the least
//            that B = sum f_k T_k can have fallen to, B - d sum l_k T_k; the farther of the two;
//   summed   (sum T_k - A) / L up to where a support begins or ends, for the field jumps there by a
//            threshold and no slope bounds a jump;
//   gated    the least (T_k - f_k) / l_k.
//
// Guarantees: no crossing is stepped over. Fails: it approaches a crossing without reaching it and
// stops where the step falls below the tolerance, before the true place; where L is far above the
// true slope that is far before it, and rays that pass the surface closer than that are drawn as
// hits: pixels are invented along silhouettes, and depths err by more than the tolerance where the
// ray meets the surface at a flat angle. Time grows with the number of overlapping metaballs, whose
// slopes add up in L although they cancel in the field, and with a density's stiffness: for
// reciprocals L is 4e5 per radius, and a tolerance that the first step does not already meet (Error
// otherwise) makes it endless.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "metaball/error.h"
#include "metaball/methods/ray_method.h"

namespace sherd {
namespace {

// The longest step, in radii: what is further away need not enter L.
constexpr double kStretch = 0.5;

// The largest |d shape / d x| for x in [0, 1].
double SteepestOf(const DensityShape& shape) {
  switch (shape.kind) {
    case ShapeKind::kPower: {  // 2 n x (1 - x^2)^(n - 1), steepest at x^2 = 1 / (2 n - 1)
      const double n = shape.degree;
      return 2 * n / std::sqrt(2 * n - 1) * std::pow((2 * n - 2) / (2 * n - 1), n - 1);
    }
    case ShapeKind::kWyvill: {  // where 30 x^4 - 51 x^2 + 11 = 0
      const double u = (51 - std::sqrt(51.0 * 51 - 4 * 30 * 11)) / 60, x = std::sqrt(u);
      return x * (44 - 68 * u + 24 * u * u) / 9;
    }
    case ShapeKind::kNishimura:
      return 2;                 // at x = 1/3
    case ShapeKind::kGaussian:  // exp(-k x^2) with exp(-k) = kBlinnTail, steepest at 2 k x^2 = 1
      return std::sqrt(-2 * std::log(kBlinnTail) / std::numbers::e);
    case ShapeKind::kCone:
      return 1;
    case ShapeKind::kReciprocal:  // x / (x^2 + c^2)^(3/2), steepest at x^2 = c^2 / 2
      return 2 / (3 * std::sqrt(3.0)) / (kReciprocalCore * kReciprocalCore);
    case ShapeKind::kCubic:
      return 4.0 / 3.0;  // (1 - x)(1 + 3 x) at x = 1/3
    case ShapeKind::kCosine:
      return (shape.degree + 0.5) * std::numbers::pi;
  }
  throw Error("there is no such density");
}

class SphereTracing final : public RayMethod {
 public:
  explicit SphereTracing(const MethodOptions& options) : options_(options) {}

  void Prepare(const MethodSurface& surface) override {
    steepest_ = surface.density.resolved.amplitude * SteepestOf(surface.density.resolved.shape);
    if (surface.lowest / steepest_ > options_.tolerance) return;
    char needed[32];
    std::snprintf(needed, sizeof needed, "%.1e", surface.lowest / steepest_);
    throw Error(
        "sphere tracing: this density is so steep that the first step already lies within the "
        "tolerance; one below " +
        std::string(needed) + " radii would be needed");
  }

  std::optional<double> FirstCrossing(RayField* field, RayCounts* counts) const override {
    const bool jumps = field->surface().mode == ThresholdMode::kSummed;
    double t = 0;
    for (int steps = 0; field->Seek(&t); ++steps) {
      if (steps == kMaxSteps) {
        ++counts->unresolved;
        break;
      }
      double end = t + kStretch * field->smallest();
      if (jumps) {
        end = field->PieceEnd(t, end);
      } else {
        field->Cover(end);
      }
      const double free = FreePath(*field, t, end);
      // Near the surface: as near as it comes. (Where nothing overlaps the stretch, free is
      // infinite.)
      if (free <= BracketAt(*field, options_.tolerance, t)) return t;
      t = std::min(t + free, end);
    }
    return std::nullopt;
  }

 private:
  // How far from t no point is inside, if nothing but what meets [t, end) counts.
  double FreePath(const RayField& field, double t, double end) const {
    const ThresholdMode mode = field.surface().mode;
    double a = 0, l = 0, b = 0, l_b = 0, thresholds = 0, least = INFINITY, nearest = INFINITY;
    for (const RayMetaball& m : field.active()) {
      if (!(m.enter < end)) continue;
      const double f = field.density().Value(m.At(t)), slope = steepest_ * m.inverse_radius;
      a += f;
      l += slope;
      b += f * m.threshold;
      l_b += slope * m.threshold;
      thresholds += m.threshold;
      least = std::min(least, m.threshold);
      nearest = std::min(nearest, (m.threshold - f) / slope);
    }
    switch (mode) {
      case ThresholdMode::kUniform:
        return (field.surface().threshold - a) / l;
      case ThresholdMode::kBlended: {
        // (L d)^2 + p d - q = 0 with p, q >= 0, solved without cancellation.
        const double p = 2 * a * l + l_b, q = std::max(0.0, b - a * a);
        const double by_blend = 2 * q / (p + std::sqrt(p * p + 4 * l * l * q));
        return std::max((least - a) / l, by_blend);
      }
      case ThresholdMode::kSummed:
        return l > 0 ? (thresholds - a) / l : INFINITY;
      case ThresholdMode::kGated:
        return nearest;
    }
    return 0;
  }

  MethodOptions options_;
  double steepest_ = 0.0;
};

}  // namespace

std::unique_ptr<RayMethod> MakeSphereTracing(const MethodOptions& options) {
  return std::make_unique<SphereTracing>(options);
}

}  // namespace sherd
