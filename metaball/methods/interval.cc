// Interval arithmetic (Mitchell 1990): on a segment of the ray every metaball's density is bounded
// by its highest value there, and a segment is passed over only when the sum of these natural
// bounds lies below the threshold; others are halved, the nearer half first.
//
// With thresholds of each metaball, where A is the highest sum of the densities:
//   blended  sum f_k (sum f - T_k) < 0 is free, and each f_k (A - T_k) is highest at the highest
//   f_k
//            or, where T_k is above A, at the lowest: tighter than A^2 less the least sum f T;
//   summed   f_k - T_k counts where the support holds the whole segment, else only if positive;
//   gated    the highest f_k - T_k.
//
// Guarantees: no crossing is passed over, for any density; u and the sum are moved outwards by more
// than their rounding (kRounding), that of the ray and the metaballs as doubles aside. An accepted
// crossing is certain (F >= T at the end of a bracket as narrow as the tolerance) unless it is
// counted as grazing. Fails: only in time. The bound exceeds the field by the slopes' sum times the
// segment's length, so it converges linearly, and slopes of overlapping metaballs, which cancel in
// the field, add up in it. In floats the raised bound is as coarse as floats are: more segments
// near the surface end as grazing.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "metaball/methods/ray_method.h"

namespace sherd {
namespace {

// What is searched at once, in radii. Coordinates are taken from its beginning, which is what lets
// floats do far from the camera.
constexpr double kStretch = 2.0;
constexpr int kMaxSegments = 100000;
// Where u <= 1, b is at most 3 radii off and the errors of s^2 and miss sum up to less than this.
template <class T>
constexpr T kRounding = T(16) * std::numeric_limits<T>::epsilon();

// The highest value of a shape for u in [u0, u1]: they fall outwards,
template <class T, class Shape>
T HighestOf(const Shape& shape, T u0, T) {
  return shape.Value(u0);
}
// but a cosine, which is 1 where a whole turn lies between and else highest at an end.
template <class T>
T HighestOf(const CosineShape& shape, T u0, T u1) {
  const T phase0 = T(shape.Rate()) * std::sqrt(u0);
  const T phase1 = T(shape.Rate()) * std::sqrt(std::min(u1, T(1)));
  const T turn = T(2 * std::numbers::pi);
  if (std::ceil(phase0 / turn) * turn <= phase1) return T(1);
  return std::max(std::cos(phase0), std::cos(phase1));
}

// A metaball relative to the beginning of what is searched.
template <class T>
struct NearMetaball {
  T b, miss, inverse_radius, threshold;
};

template <class T>
class IntervalSearch {
 public:
  // What the field has taken in, from `reference` on.
  void Start(const RayField& field, double reference) {
    density_ = field.density().resolved;
    mode_ = field.surface().mode;
    threshold_ = static_cast<T>(field.surface().threshold / density_.amplitude);
    metaballs_.clear();
    for (const RayMetaball& m : field.active()) {
      metaballs_.push_back({static_cast<T>(m.b - reference), static_cast<T>(m.miss),
                            static_cast<T>(m.inverse_radius),
                            static_cast<T>(m.threshold / density_.amplitude)});
    }
  }

  // Whether the surface holds t.
  bool Inside(T t) const {
    return WithShape(density_.shape, [&](const auto& shape) {
      T sum = 0, weighted = 0, thresholds = 0;
      bool held = false, above = false;
      for (const NearMetaball<T>& m : metaballs_) {
        const T s = (t - m.b) * m.inverse_radius;
        const T u = m.miss + s * s;
        if (!(u < T(1))) continue;
        const T f = shape.Value(u);
        held = true;
        above = above || f >= m.threshold;
        sum += f;
        weighted += f * m.threshold;
        thresholds += m.threshold;
      }
      switch (mode_) {
        case ThresholdMode::kUniform:
          return sum >= threshold_;
        case ThresholdMode::kBlended:
          return sum > T(0) && sum >= weighted / sum;
        case ThresholdMode::kSummed:
          return held && sum >= thresholds;
        case ThresholdMode::kGated:
          return above;
      }
      return false;
    });
  }

  // Whether the bounds say that no point of [t0, t1] is inside.
  bool IsFree(T t0, T t1) {
    return WithShape(density_.shape, [&](const auto& shape) {
      ranges_.clear();
      T sum = 0, size = 0;
      for (const NearMetaball<T>& m : metaballs_) {
        const T s0 = (t0 - m.b) * m.inverse_radius, s1 = (t1 - m.b) * m.inverse_radius;
        const T square0 = s0 * s0, square1 = s1 * s1;
        const T nearest = s0 <= T(0) && s1 >= T(0) ? T(0) : std::min(square0, square1);
        const T u0 = std::max(T(0), m.miss + nearest - kRounding<T>);
        if (!(u0 < T(1))) continue;
        const T u1 = m.miss + std::max(square0, square1) + kRounding<T>;
        const T highest = HighestOf(shape, u0, u1);
        sum += highest;
        size += std::abs(highest);
        if (mode_ != ThresholdMode::kUniform) {
          const bool throughout = u1 < T(1);
          // Only blended thresholds ask for the lowest; their densities fall outwards.
          ranges_.push_back(
              {throughout ? shape.Value(u1) : T(0), highest, m.threshold, throughout});
        }
      }
      const T rounding = kRounding<T> * (T(1) + T(metaballs_.size()) / T(16));
      if (mode_ == ThresholdMode::kUniform) return sum + size * rounding < threshold_;
      return ranges_.empty() || IsFreeOf(sum + size * rounding, rounding);
    });
  }

 private:
  // Of one metaball's density on a segment.
  struct Range {
    T lowest, highest, threshold;
    bool throughout;  // the support holds the whole segment
  };

  // IsFree with thresholds of each metaball. total: the highest sum of the densities.
  bool IsFreeOf(T total, T rounding) const {
    T bound = 0, size = 0, gated = -std::numeric_limits<T>::infinity();
    T least_threshold = std::numeric_limits<T>::infinity();
    for (const Range& r : ranges_) {
      if (mode_ == ThresholdMode::kBlended) {
        const T room = total - r.threshold;
        const T f = room > T(0) ? r.highest : r.lowest;
        bound += f * room;
        size += f * (total + r.threshold);
        least_threshold = std::min(least_threshold, r.threshold);
      } else {
        const T excess = r.highest - r.threshold;
        const T error = (std::abs(r.highest) + r.threshold) * rounding;
        bound += r.throughout ? excess : std::max(T(0), excess);
        size += std::abs(r.highest) + r.threshold;
        gated = std::max(gated, excess + error);
      }
    }
    if (mode_ == ThresholdMode::kGated) return gated < T(0);
    if (bound + size * rounding < T(0)) return true;
    return mode_ == ThresholdMode::kBlended && total < least_threshold * (T(1) - rounding);
  }

  std::vector<Range> ranges_;
  ThresholdMode mode_ = ThresholdMode::kUniform;
  T threshold_ = 0;  // over the amplitude, as those of the metaballs
  ResolvedDensity density_;
  std::vector<NearMetaball<T>> metaballs_;
};

template <class T>
class Interval final : public RayMethod {
 public:
  explicit Interval(const MethodOptions& options) : options_(options) {}

  void Prepare(const MethodSurface&) override {}

  std::optional<double> FirstCrossing(RayField* field, RayCounts* counts) const override {
    IntervalSearch<T> search;
    double t = 0;
    // Behind an undecided place without a crossing so far: grazing, if the field falls again.
    bool undecided = false;
    while (field->Seek(&t)) {
      const double end = t + kStretch * field->smallest();
      field->Cover(end);
      search.Start(*field, t);
      const T length = static_cast<T>(end - t);
      const T width = std::max(static_cast<T>(BracketAt(*field, options_.tolerance, t)),
                               T(4) * std::numeric_limits<T>::epsilon() * length);
      if (search.Inside(T(0))) return t;
      T at = 0, segment = length;
      for (int segments = 0; at < length; ++segments) {
        if (segments == kMaxSegments) {
          ++counts->unresolved;
          return std::nullopt;
        }
        segment = std::min(segment, length - at);
        if (search.IsFree(at, at + segment)) {
          if (undecided) ++counts->grazing;
          undecided = false;
          at += segment;
          segment *= 2;
        } else if (segment > width) {
          segment *= T(0.5);
        } else if (search.Inside(at + segment)) {
          return t + static_cast<double>(at + segment);
        } else {
          undecided = true;
          at += segment;
          segment *= 2;
        }
      }
      t = end;
    }
    if (undecided) ++counts->grazing;
    return std::nullopt;
  }

 private:
  MethodOptions options_;
};

}  // namespace

std::unique_ptr<RayMethod> MakeInterval(const MethodOptions& options) {
  if (options.single_precision) return std::make_unique<Interval<float>>(options);
  return std::make_unique<Interval<double>>(options);
}

}  // namespace sherd
