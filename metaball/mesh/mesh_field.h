// The field of a scene in double precision, for a few metaballs at a time. Local units.
// Internal to metaball/mesh/.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "metaball/cloud.h"
#include "metaball/density/shapes.h"
#include "metaball/error.h"
#include "metaball/scene.h"
#include "metaball/vec.h"

namespace sherd {

struct FieldBall {
  Vec3d center{};
  double support = 0;  // radius
  double inverse_support2 = 0;
  double threshold = 0;
  std::uint32_t idx = 0;
};

// What sums to the field at a point.
struct FieldSums {
  double f = 0;             // sum f_k
  double ft = 0;            // sum f_k T_k
  double excess = 0;        // sum (f_k - T_k)
  double best = -INFINITY;  // largest f_k - T_k
  bool any = false;         // some support holds the point

  void Add(double density, double threshold) {
    f += density;
    ft += density * threshold;
    excess += density - threshold;
    best = std::max(best, density - threshold);
    any = true;
  }
};

// The sums and their gradients.
struct FieldSlopes {
  FieldSums sums;
  Vec3d f{}, ft{}, best{};  // of sums.f, sums.ft and the best metaball's density
  std::uint32_t best_idx = 0;
};

class MeshField {
 public:
  // Throws Error for a surface the renderers would refuse.
  explicit MeshField(const Scene& scene)
      : cloud_(*scene.cloud), surface_(scene.surface), density_(ResolveDensity(surface_.density)) {
    const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
    if (!positive(surface_.threshold)) throw Error("the threshold must be positive");
    if (!positive(surface_.radius_scale)) throw Error("the radius factor must be positive");
    if (surface_.mode == ThresholdMode::kBlended && !IsNonNegative(surface_.density)) {
      throw Error("blended thresholds need a density that is nowhere negative");
    }
  }

  const DensityShape& shape() const { return density_.shape; }
  double amplitude() const { return density_.amplitude; }
  double SupportOf(std::size_t i) const {
    return cloud_.RadiusOf(i) * surface_.radius_scale * density_.support;
  }
  FieldBall BallOf(std::uint32_t i) const {
    FieldBall ball;
    ball.center = cloud_.center[i].cast<double>();
    ball.support = SupportOf(i);
    ball.inverse_support2 = 1 / (ball.support * ball.support);
    const bool own = surface_.mode != ThresholdMode::kUniform && !cloud_.threshold.empty();
    ball.threshold = own ? cloud_.threshold[i] : surface_.threshold;
    ball.idx = i;
    return ball;
  }

  // Positive or zero inside (scene.h), negative outside; continuous where ThresholdMode's rule is,
  // but for the rim of the supports, outside of which it is -T.
  double Above(const FieldSums& sums) const {
    if (!sums.any) return -surface_.threshold;
    switch (surface_.mode) {
      case ThresholdMode::kBlended:
        return sums.f > 0 ? sums.f - sums.ft / sums.f : -surface_.threshold;
      case ThresholdMode::kSummed:
        return sums.excess;
      case ThresholdMode::kGated:
        return sums.best;
      case ThresholdMode::kUniform:
        break;
    }
    return sums.f - surface_.threshold;
  }
  // Adds one metaball at p and returns its density there; 0 where its support does not hold p.
  double Add(const FieldBall& ball, const Vec3d& p, FieldSlopes* at) const {
    const Vec3d d = p - ball.center;
    const double u = Dot(d, d) * ball.inverse_support2;
    if (!(u < 1)) return 0;
    const double f = density_.amplitude * ShapeValue(density_.shape, u);
    const double rise = 2 * density_.amplitude * ShapeSlope(density_.shape, u);
    const Vec3d gradient = d * (rise * ball.inverse_support2);
    if (f - ball.threshold > at->sums.best) {
      at->best = gradient;
      at->best_idx = ball.idx;
    }
    at->sums.Add(f, ball.threshold);
    at->f += gradient;
    at->ft += gradient * ball.threshold;
    return f;
  }
  // The gradient of Above.
  Vec3d GradientOf(const FieldSlopes& at) const {
    const FieldSums& sums = at.sums;
    switch (surface_.mode) {
      case ThresholdMode::kBlended:
        return sums.f > 0 ? at.f - (at.ft - at.f * (sums.ft / sums.f)) / sums.f : at.f;
      case ThresholdMode::kGated:
        return at.best;
      default:
        return at.f;
    }
  }
  // Only the metaball whose sphere it is makes the surface (ThresholdMode::kGated).
  bool BestAlone() const { return surface_.mode == ThresholdMode::kGated; }

 private:
  const Cloud& cloud_;
  Surface surface_;
  ResolvedDensity density_;
};

}  // namespace sherd
