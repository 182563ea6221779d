#include "metaball/thesis/thesis_search.h"

#include <algorithm>
#include <cmath>

#include "metaball/thesis/octree_walk.h"

namespace sherd {
namespace {

// The step is multiplied by twice the field's distance from the threshold, relative to the
// threshold, within these bounds; and by kHorizon where the ray runs along the surface, rising to 1
// where it meets it squarely.
constexpr double kNear = 0.25, kFar = 2.0, kHorizon = 0.5;
constexpr int kMaxSteps = 100000;

// u at which a density that falls outwards reaches the threshold; -1 where it never does.
double IsoOf(const MethodDensity& density, double threshold) {
  if (!(density.Value(0) >= threshold)) return -1;
  double inside = 0, outside = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (inside + outside);
    (density.Value(middle) >= threshold ? inside : outside) = middle;
  }
  return inside;
}

}  // namespace

ThesisFrame PrepareThesisFrame(const Scene& scene, const MortonOctree& octree,
                               const ThesisOptions& options) {
  ThesisFrame frame;
  frame.cloud = scene.cloud.get();
  frame.octree = &octree;
  frame.surface = scene.surface;
  frame.options = options;
  frame.density.resolved = ResolveDensity(scene.surface.density);
  frame.monotone = IsNonNegative(scene.surface.density);
  frame.uniform_iso = IsoOf(frame.density, scene.surface.threshold);
  return frame;
}

std::optional<double> ThesisSearch::Trace(const RayD& local_ray, RayCounts* counts) {
  ray_ = local_ray;
  for (OctreeWalk walk(*frame_->octree, ray_); walk.inside(); walk.Step()) {
    if (!walk.near()) continue;
    Take(walk.node());
    const std::optional<double> depth = SearchNode(counts);
    if (!depth) continue;
    if (*depth == 0) ++counts->started_inside;
    return depth;
  }
  return std::nullopt;
}

void ThesisSearch::Take(std::uint32_t node) {
  taken_.clear();
  const MortonOctree& octree = *frame_->octree;
  for (int offset = 0; offset < 27; ++offset) {
    const std::uint32_t key =
        OctreeNeighbour(node, octree.depth(), offset % 3 - 1, offset / 3 % 3 - 1, offset / 9 - 1);
    if (key == kOctreeOutside) continue;
    for (const std::uint32_t idx : octree.MetaballsOf(key)) {
      const Vec3d to_center = frame_->cloud->center[idx].cast<double>() - ray_.origin;
      Taken taken;
      if (!MeetMetaball(to_center, ray_.direction, frame_->SupportRadiusOf(idx), idx, &taken.met)) {
        continue;
      }
      taken.across = to_center - ray_.direction * taken.met.b;
      taken.met.threshold = frame_->ThresholdOf(idx);
      taken_.push_back(taken);
    }
  }
}

std::optional<double> ThesisSearch::SearchNode(RayCounts* counts) const {
  if (taken_.empty()) return std::nullopt;
  // In the lobes of a cosine there is more than one sphere to solve for.
  if (taken_.size() == 1 && frame_->monotone) return SolveLone(taken_[0]);
  return March(counts);
}

std::optional<double> ThesisSearch::SolveLone(const Taken& taken) const {
  const double iso = taken.met.threshold == frame_->surface.threshold
                         ? frame_->uniform_iso
                         : IsoOf(frame_->density, taken.met.threshold);
  const double root2 = iso - taken.met.miss;
  if (!(root2 >= 0)) return std::nullopt;
  const double half = std::sqrt(root2) / taken.met.inverse_radius;
  if (taken.met.b + half < 0) return std::nullopt;
  return std::max(0.0, taken.met.b - half);
}

std::optional<double> ThesisSearch::March(RayCounts* counts) const {
  double begin = INFINITY, end = 0, steepest = 0;
  for (const Taken& taken : taken_) {
    begin = std::min(begin, taken.met.enter);
    end = std::max(end, taken.met.exit);
    steepest = std::max(steepest, taken.met.inverse_radius);
  }
  const double smallest = 1 / steepest;
  const double base = frame_->options.step * smallest;
  const double width = std::max(frame_->options.tolerance * smallest, 1e-14 * end);
  double t = std::max(0.0, begin);
  double level = Level(t);
  if (level >= 0) return t;
  for (int steps = 0; t < end; ++steps) {
    if (steps == kMaxSteps) {
      ++counts->unresolved;
      break;
    }
    const double near = -level / frame_->surface.threshold;
    const double along = kHorizon + (1 - kHorizon) * Horizon(t);
    // Never less than the doubles can tell apart, however far the camera.
    const double step = std::max(base * std::clamp(2 * near, kNear, kFar) * along, width);
    const double next = t + step;
    const double next_level = Level(next);
    if (next_level >= 0) {
      double outside = t, inside = next;
      while (inside - outside > width) {
        const double middle = 0.5 * (outside + inside);
        (Level(middle) >= 0 ? inside : outside) = middle;
      }
      return inside;
    }
    t = next;
    level = next_level;
  }
  return std::nullopt;
}

double ThesisSearch::Level(double t) const {
  const bool gated = frame_->gated();
  const double nothing = -frame_->surface.threshold;
  double sum = 0, weighted = 0, over = 0, added = 0, highest = nothing;
  bool held = false;
  for (const Taken& taken : taken_) {
    const double u = taken.met.At(t);
    if (!(u < 1)) continue;
    held = true;
    const double f = frame_->density.Value(u);
    const double above = f - taken.met.threshold;
    sum += f;
    weighted += f * taken.met.threshold;
    over += above;
    if (above > 0) added += above;
    highest = std::max(highest, above);
  }
  if (!held) return nothing;
  // Only what is positive is added (algorithms 2-6); below, what is nearest to being so.
  if (gated) return highest >= 0 ? added : highest;
  switch (frame_->surface.mode) {
    case ThresholdMode::kUniform:
      return sum - frame_->surface.threshold;
    case ThresholdMode::kBlended:
      return sum > 0 ? sum - weighted / sum : nothing;
    default:
      return over;
  }
}

double ThesisSearch::Horizon(double t) const {
  double along = 0;
  Vec3d across{};
  for (const Taken& taken : taken_) {
    const double u = taken.met.At(t);
    if (!(u < 1)) continue;
    const double slope = frame_->density.Slope(u);
    along += slope * taken.met.RateAt(t);
    // The point minus the centre, without its part along the ray.
    across += taken.across * (-2 * slope * taken.met.inverse_radius * taken.met.inverse_radius);
  }
  const double length = std::sqrt(along * along + Dot(across, across));
  return length > 0 && std::isfinite(length) ? std::abs(along) / length : 1.0;
}

HitSums ThesisSearch::Gather(double depth) const {
  const Vec3d point = ray_.origin + ray_.direction * depth;
  HitSums sums;
  // Of a gated sum those above their thresholds; all where rounding leaves none.
  for (const bool above_only : {frame_->gated(), false}) {
    for (const Taken& taken : taken_) {
      const double u = taken.met.At(depth);
      if (!(u < 1)) continue;
      const double f = frame_->density.Value(u);
      if (above_only && !(f >= taken.met.threshold)) continue;
      const Vec3d offset = point - frame_->cloud->center[taken.met.idx].cast<double>();
      // Directions weighted by influence (thesis 3.5).
      sums.Add(*frame_->cloud, taken.met.idx, f, Normalized(offset, Vec3d{}) * f);
    }
    if (sums.strongest_idx >= 0) break;
  }
  return sums;
}

}  // namespace sherd
