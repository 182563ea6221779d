// The shapes of the densities against the thesis's formulas, and the bounds on which every first
// crossing rests against dense sampling, all in double precision.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metaball/density/shapes.h"
#include "metaball/error.h"
#include "metaball/first_crossing.h"
#include "metaball/reference/reference_density.h"

namespace sherd {
namespace {

template <int N>
double BernsteinValue(const Bernstein<double, N>& b, double u) {
  return RightPart(b, u).c[0];
}

class DensityTest : public ::testing::TestWithParam<DensityModel> {
 protected:
  const ResolvedDensity resolved_ = ResolveDensity(GetParam());
  const DensityShape shape_ = resolved_.shape;
};

std::string NameOf(const ::testing::TestParamInfo<DensityModel>& info) {
  std::string name = TextOf(info.param);
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name + "_" + std::to_string(info.index);
}

TEST_P(DensityTest, ShapeIsTheThesisFormula) {
  const ReferenceDensity reference(GetParam());
  EXPECT_DOUBLE_EQ(reference.support(), resolved_.support);
  for (int i = 0; i <= 1000; ++i) {
    const double s = i / 999.0;  // the last one lies beyond the support
    const double x = s * resolved_.support;
    const double scale = std::max(1.0, PeakOf(GetParam()));
    EXPECT_NEAR(resolved_.amplitude * ShapeValue(shape_, s * s), reference.Value(x), 1e-13 * scale);
    if (i > 0 && i < 999) {
      const double slope =
          resolved_.amplitude * ShapeSlope(shape_, s * s) * 2 * s / resolved_.support;
      EXPECT_NEAR(slope, reference.Slope(x), 1e-9 * std::max(1.0, std::abs(reference.Slope(x))));
    }
  }
  EXPECT_NEAR(reference.Value(0), PeakOf(GetParam()), 1e-12 * PeakOf(GetParam()));
}

TEST_P(DensityTest, SlopeIsTheDerivative) {
  for (int i = 1; i < 400; ++i) {
    const double u = i / 400.0, h = 1e-6;
    if (std::abs(u - 1.0 / 9) < 2 * h) continue;  // Nishimura's two pieces meet
    const double numeric = (ShapeValue(shape_, u + h) - ShapeValue(shape_, u - h)) / (2 * h);
    EXPECT_NEAR(ShapeSlope(shape_, u), numeric, 1e-5 * std::max(1.0, std::abs(numeric))) << u;
  }
}

TEST_P(DensityTest, NoSlopeIsSteeperThanStated) {
  WithShape(shape_, [&](const auto& shape) {
    double steepest = 0;
    for (int i = 1; i < 20000; ++i) {
      const double x = i / 20000.0;
      steepest = std::max(steepest, std::abs(2 * x * ShapeSlope(shape_, x * x)));
    }
    EXPECT_LE(steepest, shape.Steepest() * 1.00001);
    EXPECT_GE(steepest, shape.Steepest() * 0.9);
    const double x = 1 - 1e-7;
    EXPECT_NEAR(-2 * x * ShapeSlope(shape_, x * x), shape.RimSlope(), 1e-4 * (1 + steepest));
  });
}

TEST_P(DensityTest, ReferenceRangesHoldEveryValue) {
  const ReferenceDensity density(GetParam());
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int round = 0; round < 500; ++round) {
    double x0 = density.support() * uniform(random), x1 = density.support() * uniform(random);
    if (x1 < x0) std::swap(x0, x1);
    const Interval value = density.ValueRange(x0, x1), slope = density.SlopeRange(x0, x1);
    for (int k = 0; k <= 40; ++k) {
      const double x = x0 + (x1 - x0) * k / 40;
      EXPECT_GE(density.Value(x), value.lo - 1e-12);
      EXPECT_LE(density.Value(x), value.hi + 1e-12 * (1 + std::abs(value.hi)));
      EXPECT_GE(density.Slope(x), slope.lo - 1e-9 * std::abs(slope.lo) - 1e-12);
      EXPECT_LE(density.Slope(x), slope.hi + 1e-9 * std::abs(slope.hi) + 1e-12);
    }
  }
}

// A random segment of a ray past one metaball, long or short, through the rim or inside.
struct Segment {
  double s0, s1, across2;
};
Segment RandomSegment(std::mt19937* random, int round) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double lengths[] = {2.5, 0.3, 0.01};
  Segment segment;
  segment.across2 = round % 7 == 0 ? 0.0 : std::pow(0.5 * (1 + uniform(*random)), 2);
  segment.s0 = 1.3 * uniform(*random);
  segment.s1 = segment.s0 + lengths[round % 3] * (1.001 + uniform(*random));
  return segment;
}

TEST_P(DensityTest, BoundIsNeverBelowTheDensityAndExactAtTheEnds) {
  std::mt19937 random(5);
  const double scale = PeakOf(GetParam()) / resolved_.amplitude;
  WithShape(shape_, [&](const auto& shape) {
    for (int round = 0; round < 6000; ++round) {
      const auto [s0, s1, across2] = RandomSegment(&random, round);
      TightBound<double, std::decay_t<decltype(shape)>> tight(shape);
      tight.Add(s0, s1, across2);
      CurvatureBound<double, AnyShape> curvature(AnyShape{shape_});
      curvature.Add(s0, s1, across2);
      const auto bound = tight.Sum();
      const auto other = curvature.Sum();
      const double f0 = ShapeValue(shape_, across2 + s0 * s0);
      const double f1 = ShapeValue(shape_, across2 + s1 * s1);
      ASSERT_NEAR(bound.c[0], f0, 1e-12 * scale);
      ASSERT_NEAR(bound.c[bound.kDegree], f1, 1e-12 * scale);
      ASSERT_NEAR(other.c[0], f0, 1e-12 * scale);
      ASSERT_NEAR(other.c[2], f1, 1e-12 * scale);
      for (int k = 0; k <= 32; ++k) {
        const double v = k / 32.0, s = s0 + v * (s1 - s0);
        const double f = ShapeValue(shape_, across2 + s * s);
        ASSERT_GE(BernsteinValue(bound, v), f - 1e-11 * scale)
            << s0 << " " << s1 << " " << across2 << " at " << v;
        ASSERT_GE(BernsteinValue(other, v), f - 1e-11 * scale)
            << s0 << " " << s1 << " " << across2 << " at " << v;
      }
    }
  });
}

TEST_P(DensityTest, BoundClosesInWithTheSquareOfTheLength) {
  // Halving a short segment inside the support divides the gap to the chord's middle by about four.
  WithShape(shape_, [&](const auto& shape) {
    const double across2 = 0.2, s = -0.5;
    const auto gap = [&](double d) {
      TightBound<double, std::decay_t<decltype(shape)>> tight(shape);
      tight.Add(s, s + d, across2);
      return BernsteinValue(tight.Sum(), 0.5) -
             ShapeValue(shape_, across2 + std::pow(s + d / 2, 2));
    };
    EXPECT_LE(gap(0.01), 0.3 * gap(0.02) + 1e-14);
    EXPECT_LE(gap(0.005), 0.3 * gap(0.01) + 1e-14);
  });
}

TEST_P(DensityTest, BlendedExcessIsNeverBelow) {
  if (!IsNonNegative(GetParam())) GTEST_SKIP() << "blended thresholds need densities >= 0";
  std::mt19937 random(6);
  std::uniform_real_distribution<double> threshold(0.1, 2);
  for (int round = 0; round < 4000; ++round) {
    BlendedBound<double, AnyShape> sums(AnyShape{shape_});
    Segment segment[3];
    double t[3];
    for (int m = 0; m < 3; ++m) {
      segment[m] = RandomSegment(&random, round);
      segment[m].s1 = segment[m].s0 + (segment[0].s1 - segment[0].s0) * (m + 1);  // other radii
      t[m] = threshold(random);
      sums.Add(segment[m].s0, segment[m].s1, segment[m].across2, t[m]);
    }
    const auto excess = sums.Excess();
    const auto weight = sums.Weight();
    for (int k = 0; k <= 32; ++k) {
      const double v = k / 32.0;
      double a = 0, b = 0;
      for (int m = 0; m < 3; ++m) {
        const double s = segment[m].s0 + v * (segment[m].s1 - segment[m].s0);
        const double f = ShapeValue(shape_, segment[m].across2 + s * s);
        a += f;
        b += f * t[m];
      }
      const double scale = 1 + a * a;
      ASSERT_GE(BernsteinValue(weight, v), a - 1e-9 * scale);
      ASSERT_GE(BernsteinValue(excess, v), a * a - b - 1e-9 * scale);
      if (k == 0 || k == 32) {
        ASSERT_NEAR(BernsteinValue(excess, v), a * a - b, 1e-9 * scale);
      }
    }
  }
}

TEST_P(DensityTest, TextNamesTheModel) {
  const DensityModel parsed = ParseDensity(TextOf(GetParam()));
  EXPECT_EQ(TextOf(parsed), TextOf(GetParam()));
  EXPECT_EQ(ResolveDensity(parsed).shape, shape_);
  EXPECT_EQ(ResolveDensity(parsed).support, resolved_.support);
  EXPECT_EQ(ResolveDensity(parsed).amplitude, resolved_.amplitude);
}

// Those of every kind, every exponent, and the stiff ones.
std::vector<DensityModel> Models() {
  std::vector<DensityModel> models = AllDensities();
  for (int exponent = 4; exponent < 16; ++exponent) {
    models.push_back({DensityKind::kPower, exponent});
  }
  models.push_back({DensityKind::kBlinn, 2, 1e4, 1.0});
  models.push_back({DensityKind::kRamp, 1, 3.0});
  models.push_back({DensityKind::kTrigonometric, 2, 1.0, 2.0});
  models.push_back({DensityKind::kTrigonometric, 2, 5.0, 2.0});
  return models;
}
INSTANTIATE_TEST_SUITE_P(All, DensityTest, ::testing::ValuesIn(Models()), NameOf);

TEST(ParseDensity, SaysWhatIsWrong) {
  for (const char* text : {"", "metaball", "power:0", "power:17", "blinn:-1", "blinn:1,2,3",
                           "murakami:2", "ramp:5", "ramp:2,3", "blinn:x", "power:2.5"}) {
    EXPECT_THROW(ParseDensity(text), InputError) << text;
  }
  EXPECT_EQ(ParseDensity("blinn:2,3").amplitude, 3.0);
  EXPECT_EQ(ParseDensity("power:16").degree, 16);
}

using March64 = RayMarch<double>;

// One Murakami metaball at t = 5, unit radius; h = 1 - across^2.
auto OneMetaball(double h, const MarchLimits<double>& limits) {
  return [=](March64* march) {
    SquareBound<double> bound;
    bound.Add(march->t - 5.0, march->t + march->dt - 5.0, 1 - h);
    return AdvanceUniform(bound.Sum(), 0.7, limits, march);
  };
}

TEST(FirstCrossing, FindsTheClosedFormOfOneMetaball) {
  // (h - s^2)^2 = T at s = -sqrt(h - sqrt(T)).
  for (const double h : {0.999, 0.95, 0.9, 0.85}) {
    const double expected = 5.0 - std::sqrt(h - std::sqrt(0.7));
    March64 march{0.0, 0.5, true, false};
    std::uint32_t grazing = 0;
    ASSERT_TRUE(RunMarch(OneMetaball(h, {5e-5, 10.0}), 1000, &march, &grazing));
    ASSERT_TRUE(march.hit);
    EXPECT_NEAR(march.t, expected, 1e-7);
  }
}

TEST(FirstCrossing, PassesJustBelowTheSurface) {
  const double h = std::sqrt(0.7) - 1e-7;  // the highest value is just under the threshold
  March64 march{0.0, 0.5, true, false};
  std::uint32_t grazing = 0;
  ASSERT_TRUE(RunMarch(OneMetaball(h, {5e-5, 10.0}), 4096, &march, &grazing));
  EXPECT_FALSE(march.hit);
}

TEST(FirstCrossing, SaysWhenItsStepsDoNotSuffice) {
  March64 march{0.0, 1e-3, true, false};
  std::uint32_t grazing = 0;
  EXPECT_FALSE(RunMarch(OneMetaball(0.9, {5e-5, 10.0}), 2, &march, &grazing));
}

TEST(FirstCrossing, ThinFeaturesBetweenLargeStepsAreNotSteppedOver) {
  // A small strong metaball hidden in the tail of a large weak one.
  std::mt19937 random(9);
  std::uniform_real_distribution<double> place(1, 9);
  for (int round = 0; round < 500; ++round) {
    const double b = place(random), r = 1e-3;
    const MarchLimits<double> limits{5e-5 * r, 10.0};
    const auto step = [&](March64* march) {
      const double t = march->t, end = march->t + march->dt;
      SquareBound<double> bound;
      bound.Add((t - 5.0) / 5.0, (end - 5.0) / 5.0, 0.4);  // at most 0.36
      bound.Add((t - b) / r, (end - b) / r, 0.01);
      return AdvanceUniform(bound.Sum(), 0.7, limits, march);
    };
    March64 march{0.0, 2.5, true, false};
    std::uint32_t grazing = 0;
    ASSERT_TRUE(RunMarch(step, 4096, &march, &grazing));
    ASSERT_TRUE(march.hit) << b;
    EXPECT_LT(std::abs(march.t - b), r);
    EXPECT_LT(march.t, b);
  }
}

}  // namespace
}  // namespace sherd
