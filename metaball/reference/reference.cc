#include "metaball/reference/reference.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "metaball/local_view.h"
#include "metaball/parallel.h"
#include "metaball/reference/reference_density.h"

namespace sherd {
namespace {

// One metaball along a ray. x, its distance from the centre in radii, is sqrt(across2 + s^2) with
// s = (t - b) / r.
struct AlongRay {
  double b, r, across2, threshold;
  double enter, exit;  // of the support
  std::uint32_t idx;

  double DistanceAt(double t) const { return std::sqrt(across2 + Square((t - b) / r)); }
  // x over [t0, t1].
  Interval Distances(double t0, double t1) const {
    const double s0 = (t0 - b) / r, s1 = (t1 - b) / r;
    const double near = s0 <= 0 && s1 >= 0 ? 0.0 : std::min(s0 * s0, s1 * s1);
    return {std::sqrt(across2 + near), std::sqrt(across2 + std::max(s0 * s0, s1 * s1))};
  }
  // dx/dt = s / (x r) over [t0, t1]: it never falls.
  Interval DistanceSlopes(double t0, double t1) const {
    const double x0 = DistanceAt(t0), x1 = DistanceAt(t1);
    return {(x0 > 0 ? (t0 - b) / (r * x0) : -1.0) / r, (x1 > 0 ? (t1 - b) / (r * x1) : 1.0) / r};
  }

  static double Square(double v) { return v * v; }
};

Interval Product(const Interval& a, const Interval& b) {
  const double corners[] = {a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi};
  const auto [lo, hi] = std::minmax_element(std::begin(corners), std::end(corners));
  return {*lo, *hi};
}
Interval Sum(const Interval& a, const Interval& b) { return {a.lo + b.lo, a.hi + b.hi}; }
Interval Scaled(const Interval& a, double k) {
  return k >= 0 ? Interval{a.lo * k, a.hi * k} : Interval{a.hi * k, a.lo * k};
}

// The surface's function along a ray, F >= 0 inside (ThresholdMode), from the metaballs `mine` that
// hold the interval asked about.
class FieldOnRay {
 public:
  FieldOnRay(const std::vector<AlongRay>& along, const ReferenceDensity& density,
             ThresholdMode mode, double threshold)
      : along_(along), density_(density), mode_(mode), threshold_(threshold) {}

  using Members = std::vector<std::uint32_t>;

  double Value(double t, const Members& mine) const {
    double a = 0, b = 0, largest = -INFINITY;
    for (const std::uint32_t k : mine) {
      const double f = density_.Value(along_[k].DistanceAt(t));
      a += f;
      b += f * along_[k].threshold;
      largest = std::max(largest, f - along_[k].threshold);
    }
    switch (mode_) {
      case ThresholdMode::kUniform:
        return a - threshold_;
      case ThresholdMode::kBlended:
        return a > 0 ? a - b / a : -INFINITY;
      case ThresholdMode::kSummed:
        return mine.empty() ? -INFINITY : a - SumOfThresholds(mine);
      case ThresholdMode::kGated:
        return largest;
    }
    return -INFINITY;
  }

  struct Bounds {
    double natural = 0.0;  // F's upper bound
    Interval slope;        // of F; infinite where none is known
  };
  Bounds Over(double t0, double t1, const Members& mine) const {
    Interval a, b, a_slope, b_slope, member_slope{INFINITY, -INFINITY};
    double lowest = INFINITY, largest = -INFINITY;
    for (const std::uint32_t k : mine) {
      const AlongRay& m = along_[k];
      const Interval x = m.Distances(t0, t1);
      const Interval f = density_.ValueRange(x.lo, x.hi);
      const Interval df = Product(density_.SlopeRange(x.lo, x.hi), m.DistanceSlopes(t0, t1));
      a = Sum(a, f);
      b = Sum(b, Scaled(f, m.threshold));
      a_slope = Sum(a_slope, df);
      b_slope = Sum(b_slope, Scaled(df, m.threshold));
      member_slope = {std::min(member_slope.lo, df.lo), std::max(member_slope.hi, df.hi)};
      lowest = std::min(lowest, m.threshold);
      largest = std::max(largest, f.hi - m.threshold);
    }
    switch (mode_) {
      case ThresholdMode::kUniform:
        return {a.hi - threshold_, a_slope};
      case ThresholdMode::kSummed:
        return {a.hi - SumOfThresholds(mine), a_slope};
      case ThresholdMode::kGated:
        return {largest, member_slope};
      case ThresholdMode::kBlended:
        break;
    }
    // F = A - B / A, F' = A' (1 + B / A^2) - B' / A; the blend of thresholds is at least the
    // lowest.
    if (!(a.lo > 0)) return {a.hi - lowest, {-INFINITY, INFINITY}};
    const double natural = std::min(a.hi - lowest, a.hi - b.lo / a.hi);
    const Interval inverse{1 / a.hi, 1 / a.lo};
    const Interval ratio = Product(b, Product(inverse, inverse));
    const Interval slope =
        Sum(Product(a_slope, {1 + ratio.lo, 1 + ratio.hi}), Scaled(Product(b_slope, inverse), -1));
    return {natural, slope};
  }

  // F's upper bound where supports may also begin and end inside the interval.
  double UpperOver(double t0, double t1, const Members& mine) const {
    double a = 0, lowest = INFINITY, largest = -INFINITY;
    for (const std::uint32_t k : mine) {
      const Interval x = along_[k].Distances(t0, t1);
      const double f = std::max(0.0, density_.ValueRange(x.lo, x.hi).hi);
      a += f;
      lowest = std::min(lowest, along_[k].threshold);
      largest = std::max(largest, f - along_[k].threshold);
    }
    switch (mode_) {
      case ThresholdMode::kUniform:
        return a - threshold_;
      case ThresholdMode::kGated:
        return largest;
      default:
        return a - lowest;
    }
  }

 private:
  double SumOfThresholds(const Members& mine) const {
    double sum = 0;
    for (const std::uint32_t k : mine) sum += along_[k].threshold;
    return sum;
  }

  const std::vector<AlongRay>& along_;
  const ReferenceDensity& density_;
  ThresholdMode mode_;
  double threshold_;
};

class FirstCrossing {
 public:
  FirstCrossing(const std::vector<AlongRay>& along, const FieldOnRay& field, double threshold)
      : along_(along), field_(field), margin_(threshold * kReferenceGrazing) {}

  // Finds the first t with F >= 0 in the pieces cuts[i]..cuts[j], where supports begin and end only
  // at cuts. Many pieces at once are passed over where their upper bound allows it.
  bool FindInPieces(const std::vector<double>& cuts, std::size_t i, std::size_t j,
                    const FieldOnRay::Members& active) {
    if (j - i == 1) return Find(cuts[i], cuts[j], active, 0);
    FieldOnRay::Members mine;
    mine.reserve(active.size());
    for (const std::uint32_t k : active) {
      if (along_[k].enter < cuts[j] && along_[k].exit > cuts[i]) mine.push_back(k);
    }
    if (mine.empty() || Below(field_.UpperOver(cuts[i], cuts[j], mine))) return false;
    const std::size_t middle = (i + j) / 2;
    return FindInPieces(cuts, i, middle, mine) || FindInPieces(cuts, middle, j, mine);
  }

  // Finds the first t in [t0, t1], one piece or a part of it, with F >= 0. `active` holds the
  // metaballs that meet it.
  bool Find(double t0, double t1, const FieldOnRay::Members& active, int depth) {
    FieldOnRay::Members mine;
    mine.reserve(active.size());
    double smallest = INFINITY;
    for (const std::uint32_t k : active) {
      if (along_[k].enter < t1 && along_[k].exit > t0) {
        mine.push_back(k);
        smallest = std::min(smallest, along_[k].r);
      }
    }
    if (mine.empty()) return false;
    const double width = t1 - t0, middle = 0.5 * (t0 + t1);
    const FieldOnRay::Bounds bounds = field_.Over(t0, t1, mine);
    const double steepest = std::max(std::abs(bounds.slope.lo), std::abs(bounds.slope.hi));
    const double by_slope = field_.Value(middle, mine) + 0.5 * width * steepest;
    if (Below(by_slope < bounds.natural ? by_slope : bounds.natural)) return false;
    // Rising throughout: one crossing at most, by bisection.
    if (bounds.slope.lo > 0) return Bisect(t0, t1, mine);
    if (depth >= kMaxDepth || width < 1e-9 * smallest) {
      if (field_.Value(t1, mine) >= 0) return Bisect(t0, t1, mine);
      grazing_ = true;
      return false;
    }
    return Find(t0, middle, mine, depth + 1) || Find(middle, t1, mine, depth + 1);
  }

  double crossing() const { return crossing_; }
  bool grazing() const { return grazing_; }

 private:
  static constexpr int kMaxDepth = 200;

  // Whether an upper bound of F rules a crossing out; notes where it does so barely.
  bool Below(double upper) {
    if (upper < 0 && upper > -margin_) grazing_ = true;
    return upper < 0;
  }

  bool Bisect(double t0, double t1, const FieldOnRay::Members& mine) {
    const double at_end = field_.Value(t1, mine);
    if (at_end < 0) {
      if (at_end > -margin_) grazing_ = true;
      return false;
    }
    if (field_.Value(t0, mine) >= 0) {
      crossing_ = t0;
      return true;
    }
    for (int i = 0; i < 200; ++i) {
      const double middle = 0.5 * (t0 + t1);
      if (middle <= t0 || middle >= t1) break;
      (field_.Value(middle, mine) >= 0 ? t1 : t0) = middle;
    }
    crossing_ = t1;
    return true;
  }

  const std::vector<AlongRay>& along_;
  const FieldOnRay& field_;
  double margin_;
  double crossing_ = 0.0;
  bool grazing_ = false;
};

double ThresholdOf(const Scene& scene, std::size_t i) {
  const bool own = scene.surface.mode != ThresholdMode::kUniform && !scene.cloud->threshold.empty();
  return own ? scene.cloud->threshold[i] : scene.surface.threshold;
}

ReferenceHit Shaded(const Scene& scene, const ReferenceDensity& density, const RayD& ray,
                    double depth, const std::vector<AlongRay>& along) {
  const Cloud& cloud = *scene.cloud;
  const ThresholdMode mode = scene.surface.mode;
  ReferenceHit hit;
  hit.hit = true;
  hit.depth = depth;
  hit.smallest_radius = INFINITY;
  const Vec3d point = ray.origin + ray.direction * depth;
  double weight = 0, strongest = -INFINITY, highest = -INFINITY;
  Vec3d color{}, outward{}, outward_of_thresholds{};
  for (const AlongRay& a : along) {
    const Vec3d offset = point - cloud.center[a.idx].cast<double>();
    const double x = Length(offset) / a.r;
    if (!(x < density.support())) continue;
    const double f = density.Value(x);
    hit.smallest_radius = std::min(hit.smallest_radius, a.r * density.support());
    if (mode == ThresholdMode::kGated) {  // the metaball whose sphere this is, alone
      if (!(f - a.threshold > highest)) continue;
      highest = f - a.threshold;
      weight = 0;
      strongest = -INFINITY;
      color = outward = {};
    }
    weight += std::max(f, 0.0);
    color += LinearFromRgb8(cloud.ColorOf(a.idx)).cast<double>() * std::max(f, 0.0);
    const double pull = x > 0 ? -density.Slope(x) / (x * a.r * a.r) : 0.0;
    outward += offset * pull;
    outward_of_thresholds += offset * (pull * a.threshold);
    if (f > strongest) {
      strongest = f;
      hit.id = static_cast<std::int32_t>(a.idx);
    }
  }
  if (weight > 0) color = color / weight;
  if (mode == ThresholdMode::kBlended) {  // grad (A - B / A) where it is 0
    outward = outward * (2 * weight) - outward_of_thresholds;
  }
  hit.normal = Normalized(outward, -ray.direction);
  hit.color = color;
  const Lighting& light = scene.lighting;
  if (!light.unlit) {
    const Vec3d to_light = light.headlight ? -ray.direction : Normalized(light.to_light);
    const double factor = light.ambient + light.diffuse * std::max(0.0, Dot(hit.normal, to_light));
    hit.color = {std::min(1.0, color.x * factor), std::min(1.0, color.y * factor),
                 std::min(1.0, color.z * factor)};
  }
  return hit;
}

ReferenceHit TraceCandidates(const Scene& scene, const ReferenceDensity& density, const RayD& ray,
                             const std::vector<std::uint32_t>& candidates) {
  const Cloud& cloud = *scene.cloud;
  std::vector<AlongRay> along;
  double begin = INFINITY, end = 0, lowest = INFINITY;
  for (const std::uint32_t i : candidates) {
    const Vec3d to_center = cloud.center[i].cast<double>() - ray.origin;
    const double r = cloud.RadiusOf(i) * scene.surface.radius_scale;
    const double b = Dot(to_center, ray.direction);
    const Vec3d across = to_center - ray.direction * b;
    const double across2 = Dot(across, across) / (r * r);
    const double chord2 = density.support() * density.support() - across2;
    if (!(chord2 > 0)) continue;
    const double half = std::sqrt(chord2) * r;
    if (!(b + half > 0)) continue;
    along.push_back({b, r, across2, ThresholdOf(scene, i), b - half, b + half, i});
    begin = std::min(begin, b - half);
    end = std::max(end, b + half);
    lowest = std::min(lowest, along.back().threshold);
  }
  if (along.empty()) return {};
  begin = std::max(begin, 0.0);

  // Pieces between the supports' ends: inside one, the same metaballs form the field throughout.
  std::vector<double> cuts{begin, end};
  for (const AlongRay& a : along) {
    if (a.enter > begin) cuts.push_back(a.enter);
    if (a.exit < end) cuts.push_back(a.exit);
  }
  std::sort(cuts.begin(), cuts.end());
  cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
  FieldOnRay::Members all(along.size());
  std::iota(all.begin(), all.end(), 0u);
  const FieldOnRay field(along, density, scene.surface.mode, scene.surface.threshold);
  FirstCrossing crossing(along, field, lowest);
  ReferenceHit hit;
  if (cuts.size() > 1 && crossing.FindInPieces(cuts, 0, cuts.size() - 1, all)) {
    hit = Shaded(scene, density, ray, crossing.crossing(), along);
  }
  hit.grazing = crossing.grazing();
  return hit;
}

// Metaballs that some ray of the block of pixels [x0, x1) x [y0, y1) may meet: those within the
// block's own spread of its middle ray. Rays of a perspective block leave the eye within an angle a
// of the middle one, so at distance t they are at most t sin(a) from it.
std::vector<std::uint32_t> BlockCandidates(const Scene& scene, double support, const Camera& local,
                                           int x0, int y0, int x1, int y1) {
  const RayD axis = RayThrough(local, 0.5 * (x0 + x1), 0.5 * (y0 + y1));
  double sine = 0, shift = 0;
  for (const int x : {x0, x1}) {
    for (const int y : {y0, y1}) {
      const RayD corner = RayThrough(local, x, y);
      sine = std::max(sine, Length(Cross(corner.direction, axis.direction)));
      shift = std::max(shift, Length(corner.origin - axis.origin));
    }
  }
  const Cloud& cloud = *scene.cloud;
  std::vector<std::uint32_t> candidates;
  for (std::uint32_t i = 0; i < cloud.size(); ++i) {
    const Vec3d v = cloud.center[i].cast<double>() - axis.origin;
    const double r = cloud.RadiusOf(i) * scene.surface.radius_scale * support;
    const double reach = 1.000001 * (r + shift + (Length(v) + r) * sine);
    const Vec3d across = Cross(v, axis.direction);
    if (Dot(across, across) <= reach * reach) candidates.push_back(i);
  }
  return candidates;
}

}  // namespace

double ReferenceField(const Scene& scene, const Vec3d& point_in_local) {
  const ReferenceDensity density(scene.surface.density);
  double sum = 0;
  for (std::size_t i = 0; i < scene.cloud->size(); ++i) {
    const Vec3d offset = point_in_local - scene.cloud->center[i].cast<double>();
    const double r = scene.cloud->RadiusOf(i) * scene.surface.radius_scale;
    sum += density.Value(Length(offset) / r);
  }
  return sum;
}

ReferenceHit ReferenceTrace(const Scene& scene, const RayD& local_ray) {
  std::vector<std::uint32_t> all(scene.cloud->size());
  std::iota(all.begin(), all.end(), 0u);
  return TraceCandidates(scene, ReferenceDensity(scene.surface.density), local_ray, all);
}

ReferenceFrame ReferenceRender(const Scene& scene, const Camera& camera, int threads,
                               const Control& control) {
  constexpr int kBlock = 16;
  const Camera local = LocalCamera(camera, scene.cloud->frame);
  const ReferenceDensity density(scene.surface.density);
  ReferenceFrame frame;
  frame.width = camera.width;
  frame.height = camera.height;
  frame.pixels.resize(static_cast<std::size_t>(camera.width) * camera.height);
  const int columns = (camera.width + kBlock - 1) / kBlock;
  const int rows = (camera.height + kBlock - 1) / kBlock;
  ParallelFor(static_cast<std::int64_t>(columns) * rows, threads, [&](std::int64_t block, int) {
    control.ThrowIfStopped();
    const int x0 = static_cast<int>(block % columns) * kBlock;
    const int y0 = static_cast<int>(block / columns) * kBlock;
    const int x1 = std::min(x0 + kBlock, camera.width);
    const int y1 = std::min(y0 + kBlock, camera.height);
    const auto candidates = BlockCandidates(scene, density.support(), local, x0, y0, x1, y1);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        frame.pixels[static_cast<std::size_t>(y) * camera.width + x] =
            TraceCandidates(scene, density, RayThrough(local, x + 0.5, y + 0.5), candidates);
      }
    }
  });
  return frame;
}

}  // namespace sherd
