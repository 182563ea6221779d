// Small scenes the tests of the engine share.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/cpu_renderer.h"
#include "metaball/renderer.h"
#include "metaball/scene.h"

namespace sherd::testing {

using sherd::SceneOf;

inline CloudInput OneMetaball(const Vec3d& center = {0, 0, 0}, double radius = 1.0) {
  CloudInput input;
  input.center = {center};
  input.radius = {radius};
  return input;
}

// n metaballs in a ball of radius 1, radii spread geometrically over [radius / spread, radius].
inline CloudInput RandomBall(int n, double radius, double spread, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  CloudInput input;
  while (static_cast<int>(input.center.size()) < n) {
    const Vec3d p{uniform(random), uniform(random), uniform(random)};
    if (Dot(p, p) > 1) continue;
    input.center.push_back(p);
    input.radius.push_back(radius * std::pow(spread, -0.5 * (1 + uniform(random))));
    const auto byte = [&] { return static_cast<std::uint8_t>(127 + 127 * uniform(random)); };
    const std::uint8_t r = byte(), g = byte(), b = byte();
    input.color.push_back({r, g, b});
  }
  return input;
}

// A threshold that gives a surface worth looking at: half of what one metaball reaches; less where
// every support that holds a point asks for it.
inline double ThresholdFor(const DensityModel& density, ThresholdMode mode) {
  return (mode == ThresholdMode::kSummed ? 0.02 : 0.5) * std::min(PeakOf(density), 5.0);
}

// RandomBall with thresholds of each metaball, 0.6 to 1.4 times the given one.
inline CloudInput BallWithThresholds(int n, double radius, double spread, unsigned seed,
                                     double threshold) {
  CloudInput input = RandomBall(n, radius, spread, seed);
  std::mt19937 random(seed + 1);
  std::uniform_real_distribution<double> factor(0.6, 1.4);
  for (int i = 0; i < n; ++i) input.threshold.push_back(threshold * factor(random));
  return input;
}

// Calls f(density) for every density that the mode can be used with.
template <class F>
void ForEveryDensity(ThresholdMode mode, const F& f) {
  for (const DensityModel& density : AllDensities()) {
    if (mode == ThresholdMode::kBlended && !IsNonNegative(density)) continue;
    f(density);
  }
}

// Which of the CPU's paths draws, and how thresholds make a surface: every pair there is a tracer
// for, as a parameter of tests.
struct PathAndMode {
  CpuPath path;
  ThresholdMode mode;
};
inline auto EveryPathAndMode() {
  return ::testing::Values(PathAndMode{CpuPath::kBest, ThresholdMode::kUniform},
                           PathAndMode{CpuPath::kBest, ThresholdMode::kBlended},
                           PathAndMode{CpuPath::kScalar, ThresholdMode::kUniform},
                           PathAndMode{CpuPath::kScalar, ThresholdMode::kBlended},
                           PathAndMode{CpuPath::kScalar, ThresholdMode::kSummed},
                           PathAndMode{CpuPath::kScalar, ThresholdMode::kGated});
}
inline std::string NameOfPathAndMode(const ::testing::TestParamInfo<PathAndMode>& info) {
  return (info.param.path == CpuPath::kBest ? "Best_" : "Scalar_") + NameOf(info.param.mode);
}

// With depth, normals and ids.
inline Frame RenderPlanes(Renderer* renderer, const Scene& scene, const Camera& camera,
                          int supersample = 1, int threads = 0) {
  RenderSettings settings;
  settings.planes = {true, true, true};
  settings.supersample = supersample;
  settings.threads = threads;
  return renderer->Render(scene, camera, settings);
}

inline Camera FrontCamera(int width = 96, int height = 64, double distance = 4.0) {
  return Camera::LookAt({0.3, 0.5, -distance}, {0, 0, 0}, {0, 1, 0}, 50 * std::numbers::pi / 180,
                        width, height);
}

}  // namespace sherd::testing
