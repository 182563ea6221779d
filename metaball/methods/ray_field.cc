#include "metaball/methods/ray_field.h"

#include <algorithm>
#include <cmath>

namespace sherd {

MethodSurface MethodSurfaceOf(const Scene& scene) {
  MethodSurface surface;
  surface.density = {ResolveDensity(scene.surface.density)};
  surface.mode = scene.surface.mode;
  surface.threshold = surface.lowest = scene.surface.threshold;
  const std::vector<float>& own = scene.cloud->threshold;
  if (surface.mode != ThresholdMode::kUniform && !own.empty()) {
    surface.lowest = *std::min_element(own.begin(), own.end());
  }
  return surface;
}

void RayField::Start(const TileList& list, const RayD& ray, const MethodSurface& surface) {
  list_ = &list;
  surface_ = &surface;
  ray_ = ray;
  next_ = 0;
  active_.clear();
  smallest_ = INFINITY;
}

void RayField::TakeIn() {
  const std::uint32_t idx = list_->entry[next_++].metaball;
  const auto support = list_->RadiusOf<double>(idx);
  RayMetaball met;
  const Vec3d to_center = list_->center[idx].cast<double>() - ray_.origin;
  if (!MeetMetaball(to_center, ray_.direction, support, idx, &met)) return;
  met.threshold = list_->ThresholdOf<double>(idx);
  active_.push_back(met);
  smallest_ = std::min(smallest_, support);
}

bool RayField::Seek(double* t) {
  const auto left = std::remove_if(active_.begin(), active_.end(),
                                   [t](const RayMetaball& m) { return !(m.exit > *t); });
  if (left != active_.end()) {
    active_.erase(left, active_.end());
    double steepest = 0;
    for (const RayMetaball& m : active_) steepest = std::max(steepest, m.inverse_radius);
    smallest_ = 1 / steepest;
  }
  double first = INFINITY;
  for (const RayMetaball& m : active_) first = std::min(first, m.enter);
  while (next_ < list_->count) {
    const double front = list_->entry[next_].front;
    if (!active_.empty() && front > std::max(*t, first)) break;
    const std::size_t before = active_.size();
    TakeIn();
    if (active_.size() == before) continue;
    if (active_.back().exit > *t) {
      first = std::min(first, active_.back().enter);
    } else {
      active_.pop_back();
    }
  }
  if (active_.empty()) return false;
  *t = std::max(*t, first);
  return true;
}

void RayField::Cover(double t1) {
  while (next_ < list_->count && static_cast<double>(list_->entry[next_].front) <= t1) {
    TakeIn();
  }
}

double RayField::PieceEnd(double t, double limit) {
  double end = limit;
  std::size_t seen = 0;
  for (;;) {
    for (; seen < active_.size(); ++seen) {
      const RayMetaball& m = active_[seen];
      if (m.enter > t) end = std::min(end, m.enter);
      if (m.exit > t) end = std::min(end, m.exit);
    }
    if (next_ == list_->count || static_cast<double>(list_->entry[next_].front) > end) {
      return end;
    }
    TakeIn();
  }
}

double RayField::Excess(double t) const {
  const ResolvedDensity& resolved = density().resolved;
  const double amplitude = resolved.amplitude;
  return WithShape(resolved.shape, [&](const auto& shape) {
    // f(metaball, shape's value) for every metaball whose support holds the point.
    const auto for_each = [&](const auto& f) {
      for (const RayMetaball& m : active_) {
        const double u = m.At(t);
        if (u < 1) f(m, shape.Value(u));
      }
    };
    double sum = 0, other = 0, highest = -INFINITY;
    bool held = false;
    switch (surface_->mode) {
      case ThresholdMode::kUniform:
        for_each([&](const RayMetaball&, double f) { sum += f; });
        return amplitude * sum - surface_->threshold;
      case ThresholdMode::kBlended:
        for_each([&](const RayMetaball& m, double f) {
          sum += f;
          other += f * m.threshold;
        });
        return sum > 0 ? amplitude * sum - other / sum : -INFINITY;
      case ThresholdMode::kSummed:
        for_each([&](const RayMetaball& m, double f) {
          sum += f;
          other += m.threshold;
          held = true;
        });
        return held ? amplitude * sum - other : -INFINITY;
      case ThresholdMode::kGated:
        for_each([&](const RayMetaball& m, double f) {
          highest = std::max(highest, amplitude * f - m.threshold);
        });
        return highest;
    }
    return highest;
  });
}

double RayField::ExcessAndRate(double t, double* rate) const {
  double sum = 0, slope = 0, weighted = 0, weighted_slope = 0, thresholds = 0;
  double highest = -INFINITY, highest_slope = 0;
  bool held = false;
  for (const RayMetaball& m : active_) {
    const double u = m.At(t);
    if (!(u < 1)) continue;
    held = true;
    const double f = density().Value(u), df = density().Slope(u) * m.RateAt(t);
    sum += f;
    slope += df;
    weighted += f * m.threshold;
    weighted_slope += df * m.threshold;
    thresholds += m.threshold;
    if (f - m.threshold > highest) {
      highest = f - m.threshold;
      highest_slope = df;
    }
  }
  *rate = slope;
  switch (surface_->mode) {
    case ThresholdMode::kUniform:
      return sum - surface_->threshold;
    case ThresholdMode::kBlended: {
      if (!(sum > 0)) {
        *rate = 0;
        return -INFINITY;
      }
      const double blend = weighted / sum;
      *rate = slope * (1 + blend / sum) - weighted_slope / sum;
      return sum - blend;
    }
    case ThresholdMode::kSummed:
      return held ? sum - thresholds : -INFINITY;
    case ThresholdMode::kGated:
      *rate = highest_slope;
      return highest;
  }
  return highest;
}

}  // namespace sherd
