#include "app/project/render_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "app/project/project.h"
#include "cuda/host_loop.h"
#include "metaball/appearance/box_filter.h"
#include "metaball/error.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

Scene WavyScene(int points) {
  CloudInput input;
  input.center = testing::WavyPoints(points);
  input.uniform_radius = 5.0 / std::sqrt(static_cast<double>(input.center.size()));
  for (const Vec3d& p : input.center) input.color.push_back(testing::WavyColor(p));
  Scene scene;
  scene.cloud = std::make_shared<const Cloud>(BuildCloud(input));
  return scene;
}

TEST(RenderPicture, StripsHaveTheRowsThatFit) {
  Camera camera;
  camera.width = 1000;
  camera.height = 700;
  EXPECT_EQ(StripRows(camera, {}, 1 << 30), 700);
  EXPECT_EQ(StripRows(camera, {}, 16 * 1000 * 10), 10);
  EXPECT_EQ(StripRows(camera, {true, false, false}, 16 * 1000 * 10), 8);
  EXPECT_EQ(StripRows(camera, {}, 1), 1);
}

TEST(RenderPicture, StripsAreThePicture) {
  const Scene scene = WavyScene(2500);
  Camera camera = testing::WavyCamera(1).Resized(200, 150);
  const auto renderer = MakeCpuRenderer();
  for (const int supersample : {1, 2}) {
    RenderSettings settings;
    settings.planes = {true, false, true};
    settings.supersample = supersample;
    const Frame whole = renderer->Render(scene, camera, settings);
    int next = 0;
    double worst = 0;
    std::size_t different_hits = 0;
    const RenderStats stats = RenderInStrips(
        renderer.get(), scene, camera, settings,
        [&](Frame&& strip) {
          ASSERT_EQ(strip.width, 200);
          for (std::size_t i = 0; i < strip.color.size(); ++i) {
            const std::size_t at = static_cast<std::size_t>(next) * 200 + i;
            different_hits += (strip.depth[i] > 0) != (whole.depth[at] > 0);
            worst = std::max<double>(worst, std::abs(strip.depth[i] - whole.depth[at]));
          }
          next += strip.height;
        },
        {}, 200 * 24 * 33);
    EXPECT_EQ(next, 150);
    // Other tiles, so other rounding, but the same surface.
    EXPECT_LE(different_hits, 2u);
    EXPECT_LT(worst, 1e-4);
    EXPECT_EQ(stats.rays, whole.stats.rays);
    EXPECT_NEAR(static_cast<double>(stats.hits), static_cast<double>(whole.stats.hits), 3);
    EXPECT_EQ(stats.metaballs, whole.stats.metaballs);
  }
}

TEST(RenderPicture, CancelsBetweenStrips) {
  const Scene scene = WavyScene(400);
  const auto renderer = MakeCpuRenderer();
  std::stop_source stop;
  Control control;
  control.stop = stop.get_token();
  int strips = 0;
  EXPECT_THROW(RenderInStrips(
                   renderer.get(), scene, testing::WavyCamera(0), {},
                   [&](Frame&&) {
                     if (++strips == 2) stop.request_stop();
                   },
                   control, 160 * 16 * 10),
               Cancelled);
  EXPECT_EQ(strips, 2);
}

// A cloth with photographs, as a level.
struct Photographed {
  std::shared_ptr<const Survey> survey;
  std::shared_ptr<const Level> level;
  Scene scene;
  Camera camera = testing::WavyCamera(2);

  Photographed() {
    const std::string folder = testing::FreshFolder("project");
    testing::WriteWorkspace(folder + "/ws", 4900);
    ImportOptions options;
    options.source = folder + "/ws";
    Project project = ImportSurvey(options, folder + "/p.sherd");
    BuildLevels(&project, {1000}, {});
    survey = project.LoadSurveyFromCache();
    level = project.LoadLevel("1k");
    scene.cloud = std::shared_ptr<const Cloud>(level, &level->cloud);
    scene.surface.threshold = level->stats.threshold;
    scene.lighting.unlit = true;
  }
};

TEST(RenderPicture, PhotographsShowWhatTheyShow) {
  const Photographed cloth;
  const auto cpu = MakeCpuRenderer();
  const Frame blended = cpu->Render(cloth.scene, cloth.camera, {});
  PhotographShader photographs = MakePhotographShader(*cloth.survey, cpu.get());
  PhotographRenderer renderer(cpu.get(), &photographs, cloth.level);
  RenderSettings settings;
  settings.supersample = 2;
  const Frame shaded = renderer.Render(cloth.scene, cloth.camera, settings);
  EXPECT_TRUE(shaded.normal.empty());
  EXPECT_GT(renderer.photo_stats().from_photos, shaded.stats.hits / 2);

  // The cloth's chequers are flat colours with sharp edges: most pixels show one of the two
  // colours where photographs are used, and the blended colours are soft around the edges.
  const auto pure = [](const Frame& frame) {
    double count = 0, hits = 0;
    const Vec3f a = LinearFromRgb8({190, 120, 70}), b = LinearFromRgb8({90, 110, 130});
    for (const Pixel& p : frame.color) {
      if (p.a < 1) continue;
      ++hits;
      const Vec3f c{p.r, p.g, p.b};
      count += Length(c - a) < 0.03f || Length(c - b) < 0.03f;
    }
    return count / hits;
  };
  EXPECT_GT(pure(shaded), 0.65);
  EXPECT_GT(pure(shaded), pure(blended) + 0.1);
}

// Lights and shadows over the photographs' colours are cast where the surface is drawn.
TEST(RenderPicture, LightsAndShadowsFallOnPhotographs) {
  Photographed cloth;
  const Camera& camera = cloth.camera;
  RenderSettings settings;
  settings.planes.light = true;
  const auto cpu = MakeCpuRenderer();
  PhotographShader photographs = MakePhotographShader(*cloth.survey, cpu.get());
  PhotographRenderer renderer(cpu.get(), &photographs, cloth.level);
  const Frame unlit = renderer.Render(cloth.scene, camera, {});
  EXPECT_TRUE(unlit.light.empty());
  Light sun;
  sun.kind = LightKind::kDirectional;
  sun.to_light = {0.9, 0.1, 0.2};
  cloth.scene.appearance.lights = {sun};
  cloth.scene.appearance.shadows.enabled = true;
  cloth.scene.lighting.unlit = false;
  const Frame expected = cpu->Render(cloth.scene, camera, settings);
  const auto check = [&](Renderer* inner) {
    PhotographShader own = MakePhotographShader(*cloth.survey, inner);
    const Frame lit = PhotographRenderer(inner, &own, cloth.level).Render(cloth.scene, camera, {});
    EXPECT_TRUE(lit.light.empty() && lit.id.empty());
    std::size_t hits = 0, off = 0;
    for (std::size_t i = 0; i < lit.color.size(); ++i) {
      if (unlit.color[i].a == 0) continue;
      ++hits;
      const float red = std::min(1.0f, unlit.color[i].r * expected.light[i].x);
      off += !(std::abs(lit.color[i].r - red) < 2e-3f);
    }
    EXPECT_GT(hits, 3000u);
    EXPECT_LE(off, hits / 500);
  };
  check(cpu.get());
  check(MakeHostLoopRenderer().get());
  const auto in_shadow = std::ranges::count_if(expected.light, [&](const Vec3f& light) {
    return light.x == static_cast<float>(cloth.scene.lighting.ambient);
  });
  EXPECT_GT(in_shadow, 500);
}

TEST(RenderPicture, ThePhotographsColorsAreFiltered) {
  Photographed cloth;
  const auto cpu = MakeCpuRenderer();
  PhotographShader photographs = MakePhotographShader(*cloth.survey, cpu.get());
  PhotographRenderer renderer(cpu.get(), &photographs, cloth.level);
  Frame expected = renderer.Render(cloth.scene, cloth.camera, {});
  BoxFilter(expected.width, expected.height, 3, &expected.color, 1);
  cloth.scene.appearance.filter = 3;
  const Frame filtered = renderer.Render(cloth.scene, cloth.camera, {});
  double sum = 0;
  for (int y = 1; y + 1 < expected.height; ++y) {
    for (int x = 1; x + 1 < expected.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * expected.width + x;
      sum += std::abs(filtered.color[i].g - expected.color[i].g);
    }
  }
  EXPECT_LT(sum / static_cast<double>(expected.color.size()), 1e-3);
}

}  // namespace
}  // namespace sherd
