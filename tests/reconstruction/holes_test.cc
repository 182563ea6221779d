// The default radius closes the surface where the cloud is dense enough (the table in radii.cc).
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metaball/support_index.h"
#include "reconstruction/level.h"

namespace sherd {
namespace {

struct SheetCase {
  const char* name;
  bool sphere;
  Vec3d normal;
  bool random;   // points strewn, else on a jittered grid
  double noise;  // across the sheet, in spacings of the level
  double reduction;
  double allowed;  // open share
};

class Holes : public ::testing::TestWithParam<SheetCase> {};

TEST_P(Holes, TheDefaultRadiusLeavesNextToNothingOpen) {
  const SheetCase& c = GetParam();
  constexpr int kTarget = 8000;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> gauss;
  const Vec3d a = Normalized(Cross(c.normal, Vec3d{0.2, 0.9, 0.1})), b = Cross(c.normal, a);
  const int n = static_cast<int>(kTarget * c.reduction);
  const double area = c.sphere ? 4 * M_PI : 1.0;
  const double spacing = std::sqrt(area / kTarget);
  Survey survey;
  const int side = static_cast<int>(std::sqrt(n));
  for (int i = 0; i < n; ++i) {
    Vec3d p, normal = c.normal;
    if (c.sphere) {
      const double z = 1 - 2 * (i + 0.5) / n, phi = i * M_PI * (3 - std::sqrt(5.0));
      const double r = std::sqrt(1 - z * z);
      normal = Normalized(Vec3d{r * std::cos(phi), r * std::sin(phi), z} +
                          Vec3d{gauss(random), gauss(random), gauss(random)} *
                              (0.3 * std::sqrt(area / n)));
      p = normal;
    } else if (c.random) {
      p = a * uniform(random) + b * uniform(random);
    } else {
      p = a * ((i % side + 0.25 + 0.5 * uniform(random)) / side) +
          b * ((i / side + 0.25 + 0.5 * uniform(random)) / side);
    }
    survey.points.position.push_back(p + normal * (c.noise * spacing * gauss(random)));
  }
  LevelOptions options;
  options.target_count = kTarget;
  const Level level = BuildLevel(PreparePoints(survey, false), survey, options);
  ASSERT_EQ(level.cloud.size(), static_cast<std::size_t>(std::min(kTarget, n)));
  EXPECT_EQ(level.stats.open_share, 0);

  const SupportIndex index(level.cloud);
  constexpr int kRays = 20000;
  int open = 0;
  for (int k = 0; k < kRays; ++k) {
    Vec3d p, normal = c.normal;
    if (c.sphere) {
      const double z = 2 * uniform(random) - 1, phi = 2 * M_PI * uniform(random);
      const double r = std::sqrt(1 - z * z);
      normal = p = {r * std::cos(phi), r * std::sin(phi), z};
    } else {  // away from the border
      p = a * (0.05 + 0.9 * uniform(random)) + b * (0.05 + 0.9 * uniform(random));
    }
    bool closed = false;
    const double reach = (2 * c.noise + 2.5) * spacing;
    for (int j = 0; j <= 40 && !closed; ++j) {
      const Vec3f q =
          level.cloud.frame.LocalFromWorld(p + normal * (reach * (1 - j / 20.0))).cast<float>();
      float field = 0;
      const SupportIndex::Range range = index.At(q);
      for (const std::uint32_t* i = range.begin; i != range.end; ++i) {
        const Vec3f d = q - level.cloud.center[*i];
        const float r = level.cloud.RadiusOf(*i);
        const float x = 1 - Dot(d, d) / (r * r);
        if (x > 0) field += x * x;
      }
      closed = field >= level.stats.threshold;
    }
    open += !closed;
  }
  EXPECT_LE(open, c.allowed * kRays) << c.name;
}

INSTANTIATE_TEST_SUITE_P(
    Sheets, Holes,
    ::testing::Values(SheetCase{"axis", false, {0, 0, 1}, false, 0, 7, 0.001},
                      SheetCase{"diagonal", false, Normalized(Vec3d{1, 1, 1}), false, 0, 7, 0.001},
                      SheetCase{"tilted_noise", false, Normalized(Vec3d{0.3, 0.1, 1}), false, 0.5,
                                7, 0.001},
                      SheetCase{"axis_noise", false, {0, 0, 1}, false, 1.0, 7, 0.001},
                      SheetCase{"random_noise", false, {0, 0, 1}, true, 0.25, 7, 0.001},
                      SheetCase{"sphere", true, {0, 0, 1}, false, 0.25, 7, 0.001},
                      SheetCase{"random_half", false, {0, 0, 1}, true, 0.25, 2, 0.001},
                      SheetCase{"sphere_half", true, {0, 0, 1}, false, 0.5, 2, 0.001},
                      SheetCase{"axis_all", false, {0, 0, 1}, false, 0.25, 1, 0.001},
                      SheetCase{"sphere_all", true, {0, 0, 1}, false, 0, 1, 0.001},
                      SheetCase{"random_all", false, {0, 0, 1}, true, 0.25, 1, 0.005}),
    [](const auto& sheet) { return std::string(sheet.param.name); });

}  // namespace
}  // namespace sherd
