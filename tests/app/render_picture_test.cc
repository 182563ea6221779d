#include "app/project/render_picture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "app/project/project.h"
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

TEST(RenderPicture, PhotographsShowWhatTheyShow) {
  const std::string folder = testing::FreshFolder("project");
  testing::WriteWorkspace(folder + "/ws", 4900);
  ImportOptions options;
  options.source = folder + "/ws";
  Project project = ImportSurvey(options, folder + "/p.sherd");
  BuildLevels(&project, {1000}, {});
  const auto survey = project.LoadSurveyFromCache();
  const auto level = project.LoadLevel("1k");
  Scene scene;
  scene.cloud = std::shared_ptr<const Cloud>(level, &level->cloud);
  scene.surface.threshold = level->stats.threshold;
  scene.lighting.unlit = true;
  const Camera camera = testing::WavyCamera(2);
  const auto cpu = MakeCpuRenderer();
  const Frame blended = cpu->Render(scene, camera, {});
  PhotographRenderer renderer(cpu.get(), *survey, level.get());
  RenderSettings settings;
  settings.supersample = 2;
  const Frame shaded = renderer.Render(scene, camera, settings);
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

}  // namespace
}  // namespace sherd
