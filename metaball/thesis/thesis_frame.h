// What the thesis's search needs of a scene, once a frame.
#pragma once

#include <algorithm>

#include "metaball/density/model.h"
#include "metaball/scene.h"
#include "metaball/thesis/thesis_renderer.h"
#include "metaball/thesis/thesis_search.h"

namespace sherd {

// Local units. O(n).
inline double LargestRadius(const Cloud& cloud) {
  double largest = cloud.uniform_radius;
  for (const float r : cloud.radius) largest = std::max(largest, static_cast<double>(r));
  return largest;
}

// The largest support's radius, local units: what the octree adds around the centres.
inline double ThesisMargin(double largest_radius, const Surface& surface) {
  return largest_radius * surface.radius_scale * ResolveDensity(surface.density).support;
}

// Whether each metaball's threshold is its own.
inline bool HasOwnThresholds(const Scene& scene) {
  return scene.surface.mode != ThresholdMode::kUniform && !scene.cloud->threshold.empty();
}

// shape: that of the scene's density.
template <class Real, class Shape>
ThesisDensity<Real, Shape> ThesisDensityOf(const Scene& scene, const Shape& shape) {
  return {shape, static_cast<Real>(ResolveDensity(scene.surface.density).amplitude)};
}

template <class Real>
ThesisRules<Real> ThesisRulesOf(const Scene& scene, const ThesisOptions& options) {
  const Surface& surface = scene.surface;
  const ResolvedDensity density = ResolveDensity(surface.density);
  const ThesisDensity<double, AnyShape> exact{AnyShape{density.shape}, density.amplitude};
  ThesisRules<Real> rules;
  rules.gated = options.gated || surface.mode == ThresholdMode::kGated;
  rules.monotone = IsNonNegative(surface.density);
  rules.mode = surface.mode;
  rules.threshold = static_cast<Real>(surface.threshold);
  rules.uniform_iso = static_cast<Real>(exact.IsoOf(surface.threshold));
  rules.radius_scale = static_cast<Real>(surface.radius_scale);
  rules.support = static_cast<Real>(density.support);
  rules.step = static_cast<Real>(options.step);
  rules.tolerance = static_cast<Real>(options.tolerance);
  return rules;
}

}  // namespace sherd
