#include "metaball/appearance/color_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "metaball/appearance/legend.h"
#include "metaball/error.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

TEST(ColorMap, PassesThroughItsColours) {
  const std::vector<Rgb8> nodes = {{10, 20, 30}, {200, 100, 50}, {0, 255, 0}};
  const ColorMap map("three", nodes);
  EXPECT_EQ(Rgb8FromLinear(map.At(0)), nodes[0]);
  EXPECT_EQ(Rgb8FromLinear(map.At(0.5)), nodes[1]);
  EXPECT_EQ(Rgb8FromLinear(map.At(1)), nodes[2]);
  EXPECT_EQ(Rgb8FromLinear(map.Reversed().At(0)), nodes[2]);
  EXPECT_EQ(map.At(-3), map.At(0));
  EXPECT_EQ(map.At(7), map.At(1));
  EXPECT_EQ(map.At(std::numeric_limits<double>::quiet_NaN()), kNoValue);
  EXPECT_THROW(ColorMap("one", {{1, 2, 3}}), Error);
}

// A fine ramp shows no band: neighbouring values differ by far less than an eye sees. Nowhere but
// at the end of a map that ends in black is anything black.
TEST(ColorMap, HasNoBandsAndNoBlack) {
  constexpr int kRamp = 4000;
  for (const std::string& name : ColorMapNames()) {
    const ColorMap& map = ColorMapNamed(name);
    double largest = 0, smallest_step = 1;
    for (int i = 0; i <= kRamp; ++i) {
      const Vec3f c = map.At(static_cast<double>(i) / kRamp);
      const float brightest =
          std::max({SrgbFromLinear(c.x), SrgbFromLinear(c.y), SrgbFromLinear(c.z)});
      const bool starts_black = name == "magma";
      if (!starts_black || i > kRamp / 50) {
        EXPECT_GT(brightest, 0.04) << name << " " << i;
      }
      if (i == 0) continue;
      const Vec3f before = map.At(static_cast<double>(i - 1) / kRamp);
      const double step = std::hypot(SrgbFromLinear(c.x) - SrgbFromLinear(before.x),
                                     SrgbFromLinear(c.y) - SrgbFromLinear(before.y),
                                     SrgbFromLinear(c.z) - SrgbFromLinear(before.z));
      largest = std::max(largest, step);
      smallest_step = std::min(smallest_step, step);
    }
    EXPECT_LT(largest, 0.006) << name;
    EXPECT_GT(smallest_step, 0) << name;
  }
}

// The uniform maps grow lighter all the way.
TEST(ColorMap, UniformMapsRiseInLightness) {
  for (const char* name : {"viridis", "cividis", "magma", "grey"}) {
    const ColorMap& map = ColorMapNamed(name);
    double before = -1;
    for (int i = 0; i <= 100; ++i) {
      const Vec3f c = map.At(i / 100.0);
      const double y = 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
      EXPECT_GT(y, before) << name << " " << i;
      before = y;
    }
  }
}

TEST(ColorMap, UnknownNamesAreAnsweredWithThoseThereAre) {
  try {
    ColorMapNamed("jet");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("viridis, cividis, magma, grey, ten"),
              std::string::npos);
  }
}

TEST(Legend, TicksAreRoundAndInside) {
  int decimals = -1;
  EXPECT_EQ(RoundTicks(0, 1, 6, &decimals), (std::vector<double>{0, 0.2, 0.4, 0.6, 0.8, 1.0}));
  EXPECT_EQ(decimals, 1);
  EXPECT_EQ(RoundTicks(-130, 270, 6, &decimals), (std::vector<double>{-100, 0, 100, 200}));
  EXPECT_EQ(decimals, 0);
  for (const double lo : {-1e6, -0.37, 0.0, 12.3456, 5e8}) {
    for (const double span : {1e-5, 0.3, 7.0, 1234.5}) {
      for (const int most : {2, 5, 9}) {
        const auto ticks = RoundTicks(lo, lo + span, most, &decimals);
        EXPECT_GE(ticks.size(), 1u);
        EXPECT_LE(static_cast<int>(ticks.size()), most);
        for (const double t : ticks) {
          EXPECT_GE(t, lo);
          EXPECT_LE(t, lo + span);
        }
      }
    }
  }
}

TEST(Legend, SaysWhatThePictureShows) {
  Scene scene = testing::SceneOf(testing::OneMetaball());
  EXPECT_THROW(MakeLegend(scene, testing::FrontCamera()), Error);
  scene.appearance.color = ColorSource::kQuantity;
  scene.appearance.pseudo.quantity = Quantity::kPosition;
  scene.appearance.pseudo.range = ColorRange{-2, 2};
  const Legend legend = MakeLegend(scene, testing::FrontCamera(), 5);
  EXPECT_EQ(legend.title, "z");
  ASSERT_EQ(legend.ticks.size(), 5u);
  EXPECT_EQ(legend.ticks[1].label, "-1");
  EXPECT_DOUBLE_EQ(legend.ticks[1].position, 0.25);
  EXPECT_EQ(legend.colors.front(), (Rgb8{0x44, 0x01, 0x54}));
  EXPECT_EQ(legend.colors.back(), (Rgb8{0xfd, 0xe7, 0x25}));
  scene.appearance.pseudo.quantity = Quantity::kNormal;
  EXPECT_THROW(MakeLegend(scene, testing::FrontCamera()), Error);
}

}  // namespace
}  // namespace sherd
