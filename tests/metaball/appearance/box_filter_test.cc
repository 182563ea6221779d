#include "metaball/appearance/box_filter.h"

#include <gtest/gtest.h>

#include <random>

#include "metaball/error.h"
#include "metaball/renderer.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

Pixel MeanAround(const std::vector<Pixel>& color, int width, int height, int x, int y, int reach) {
  double r = 0, g = 0, b = 0, a = 0;
  int count = 0;
  for (int j = std::max(0, y - reach); j <= std::min(height - 1, y + reach); ++j) {
    for (int i = std::max(0, x - reach); i <= std::min(width - 1, x + reach); ++i) {
      const Pixel& p = color[static_cast<std::size_t>(j) * width + i];
      r += p.r;
      g += p.g;
      b += p.b;
      a += p.a;
      ++count;
    }
  }
  return {static_cast<float>(r / count), static_cast<float>(g / count),
          static_cast<float>(b / count), static_cast<float>(a / count)};
}

TEST(BoxFilter, EqualsTheMeanOfTheSquare) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const auto& [width, height] : {std::pair{131, 47}, {7, 90}, {1, 1}, {3, 2}}) {
    std::vector<Pixel> color(static_cast<std::size_t>(width) * height);
    for (Pixel& p : color) {
      if (uniform(random) < 0.3f) continue;  // background
      p = {uniform(random), uniform(random), uniform(random), 1};
    }
    for (const int size : {1, 3, 5, 7, 9, 11}) {
      std::vector<Pixel> filtered = color;
      BoxFilter(width, height, size, &filtered);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const Pixel expected = MeanAround(color, width, height, x, y, size / 2);
          const Pixel& p = filtered[static_cast<std::size_t>(y) * width + x];
          ASSERT_NEAR(p.r, expected.r, 2e-7);
          ASSERT_NEAR(p.g, expected.g, 2e-7);
          ASSERT_NEAR(p.b, expected.b, 2e-7);
          ASSERT_NEAR(p.a, expected.a, 2e-7);
          ASSERT_GE(p.a, 0.0f);
        }
      }
    }
  }
}

TEST(BoxFilter, RefusesOtherSizes) {
  std::vector<Pixel> color(4);
  for (const int size : {-3, 0, 2, 4, 13}) EXPECT_THROW(BoxFilter(2, 2, size, &color), Error);
}

// Premultiplied alpha: the rim of a white thing stays white, only thinner.
TEST(BoxFilter, MakesNoDarkRim) {
  CloudInput input = testing::OneMetaball();
  input.color = {{255, 255, 255}};
  Scene scene = testing::SceneOf(input);
  scene.lighting.unlit = true;
  scene.appearance.filter = 7;
  const Frame frame = MakeCpuRenderer()->Render(scene, testing::FrontCamera(), {});
  int rim = 0;
  for (const Pixel& p : frame.color) {
    if (p.a > 0.0f && p.a < 1.0f) ++rim;
    EXPECT_NEAR(p.r, p.a, 1e-6);
  }
  EXPECT_GT(rim, 100);
}

// Parts of a filtered picture fit together: the filter sees beyond a part's border.
TEST(BoxFilter, PartsFitTogether) {
  Scene scene = testing::SceneOf(testing::RandomBall(200, 0.4, 2, 6));
  scene.appearance.filter = 9;
  const Camera camera = testing::FrontCamera(90, 60);
  const auto renderer = MakeCpuRenderer();
  for (const int supersample : {1, 2}) {
    RenderSettings settings;
    settings.supersample = supersample;
    settings.planes.depth = true;
    const Frame whole = renderer->Render(scene, camera, settings);
    ASSERT_EQ(whole.width, 90);
    const Frame part = renderer->Render(scene, camera.Cropped(20, 25, 50, 17), settings);
    ASSERT_EQ(part.depth.size(), 50u * 17);
    float largest = 0;
    for (int y = 0; y < 17; ++y) {
      for (int x = 0; x < 50; ++x) {
        const Pixel& a = whole.color[static_cast<std::size_t>(y + 25) * 90 + x + 20];
        const Pixel& b = part.color[static_cast<std::size_t>(y) * 50 + x];
        largest = std::max({largest, std::abs(a.r - b.r), std::abs(a.a - b.a)});
        EXPECT_NEAR(whole.depth[static_cast<std::size_t>(y + 25) * 90 + x + 20],
                    part.depth[static_cast<std::size_t>(y) * 50 + x], 1e-3);
      }
    }
    EXPECT_LT(largest, 2e-3f);
  }
}

}  // namespace
}  // namespace sherd
