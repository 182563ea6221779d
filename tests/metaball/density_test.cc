// The bound on which every first crossing rests, against dense sampling in double precision.
#include "metaball/density.h"

#include <gtest/gtest.h>

#include <random>

#include "metaball/first_crossing.h"

namespace sherd {
namespace {

double BernsteinValue(const FieldBound<double>& b, double u) {
  double value, slope;
  EvaluateBound(b, u, &value, &slope);
  return value;
}

TEST(FieldBound, IsNeverBelowTheFieldAndExactAtTheEnds) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 20000; ++round) {
    const double s0 = 3 * uniform(random);
    const double s1 = s0 + 2.5 * (1 + uniform(random)) * (round % 3 ? 1.0 : 0.01);
    const double h = 0.5 * (1 + uniform(random)) + 1e-6;
    FieldBound<double> bound;
    bound.Add(s0, s1, h);
    EXPECT_DOUBLE_EQ(bound.c[0], Murakami::Value(h - s0 * s0));
    EXPECT_DOUBLE_EQ(bound.c[4], Murakami::Value(h - s1 * s1));
    const bool whole = bound.c[0] > 0 && bound.c[4] > 0;
    for (int k = 0; k <= 32; ++k) {
      const double u = k / 32.0;
      const double s = s0 + u * (s1 - s0);
      const double f = Murakami::Value(h - s * s);
      ASSERT_GE(BernsteinValue(bound, u), f - 1e-12) << s0 << " " << s1 << " " << h << " " << u;
      if (whole) {
        ASSERT_NEAR(BernsteinValue(bound, u), f, 1e-12);
      }
    }
  }
}

TEST(FirstCrossing, FindsTheClosedFormOfOneMetaball) {
  // (h - s^2)^2 = T at s = -sqrt(h - sqrt(T)).
  for (const double h : {0.999, 0.95, 0.9, 0.85}) {
    const double expected = 5.0 - std::sqrt(h - std::sqrt(0.7));
    const auto field = [&](double t, double dt, FieldBound<double>* bound) {
      bound->Add(t - 5.0, t + dt - 5.0, h);
    };
    March<double> march;
    march.dt = 0.5;
    const MarchLimits<double> limits{0.7, 5e-5, 10.0};
    ASSERT_TRUE(FindFirstCrossing(field, limits, 1000, &march));
    ASSERT_EQ(march.status, MarchStatus::kHit);
    EXPECT_NEAR(march.t, expected, 1e-7);
  }
}

TEST(FirstCrossing, PassesJustBelowTheSurface) {
  const double h = std::sqrt(0.7) - 1e-7;  // the highest value is just under the threshold
  const auto field = [&](double t, double dt, FieldBound<double>* bound) {
    bound->Add(t - 5.0, t + dt - 5.0, h);
  };
  March<double> march;
  march.dt = 0.5;
  ASSERT_TRUE(FindFirstCrossing(field, MarchLimits<double>{0.7, 5e-5, 10.0}, 4096, &march));
  EXPECT_EQ(march.status, MarchStatus::kExhausted);
}

TEST(FirstCrossing, SaysWhenItsStepsDoNotSuffice) {
  const auto field = [&](double t, double dt, FieldBound<double>* bound) {
    bound->Add(t - 5.0, t + dt - 5.0, 0.9);
  };
  March<double> march;
  march.dt = 1e-3;
  EXPECT_FALSE(FindFirstCrossing(field, MarchLimits<double>{0.7, 5e-5, 10.0}, 2, &march));
}

TEST(FirstCrossing, ThinFeaturesBetweenLargeStepsAreNotSteppedOver) {
  // A small strong metaball hidden in the tail of a large weak one.
  std::mt19937 random(9);
  std::uniform_real_distribution<double> place(1, 9);
  for (int round = 0; round < 500; ++round) {
    const double b = place(random), r = 1e-3;
    const auto field = [&](double t, double dt, FieldBound<double>* bound) {
      bound->Add((t - 5.0) / 5.0, (t + dt - 5.0) / 5.0, 0.6);  // at most 0.36
      bound->Add((t - b) / r, (t + dt - b) / r, 0.99);
    };
    March<double> march;
    march.dt = 2.5;
    ASSERT_TRUE(FindFirstCrossing(field, MarchLimits<double>{0.7, 5e-5 * r, 10.0}, 4096, &march));
    ASSERT_EQ(march.status, MarchStatus::kHit) << b;
    EXPECT_LT(std::abs(march.t - b), r);
    EXPECT_LT(march.t, b);
  }
}

}  // namespace
}  // namespace sherd
