// Lights, shadows and ambient occlusion against what geometry says.
#include <gtest/gtest.h>

#include <cmath>

#include "metaball/appearance/occlusion.h"
#include "metaball/renderer.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

constexpr double kThreshold = 0.7;
// A metaball of radius 1 alone is a sphere of this radius.
const double kSphere = std::sqrt(1 - std::sqrt(kThreshold));

RenderSettings WithPlanes() {
  RenderSettings settings;
  settings.planes = {.depth = true, .normal = true};
  return settings;
}

Vec3d PointAt(const Camera& camera, const Frame& frame, std::size_t i) {
  const RayD ray = RayThrough(camera, i % frame.width + 0.5, i / frame.width + 0.5);
  return ray.origin + ray.direction * double{frame.depth[i]};
}

Scene TwoSpheres() {
  CloudInput input;
  input.center = {{0, 0, 0}, {0, 5.2, 0}};
  input.radius = {4, 1};  // a large one below a small one, out of its reach
  Scene scene = testing::SceneOf(input, kThreshold);
  scene.lighting.ambient = 0.1;
  scene.lighting.diffuse = 0.9;
  scene.appearance.shadows.enabled = true;
  return scene;
}

TEST(Lights, AreSummedThenClamped) {
  CloudInput input = testing::OneMetaball();
  input.color = {{255, 255, 255}};
  Scene scene = testing::SceneOf(input, kThreshold);
  scene.lighting.ambient = 0.2;
  scene.lighting.diffuse = 0.5;
  Light red{.kind = LightKind::kDirectional, .to_light = {1, 0, -1}, .color = {1, 0, 0}};
  Light place{
      .kind = LightKind::kPoint, .position = {-2, 1, -1}, .color = {0, 0.5f, 1}, .intensity = 3};
  // The camera's right and up: x and -y of its own axes.
  Light moving{.kind = LightKind::kDirectional,
               .to_light = {1, -1, 0},
               .with_camera = true,
               .color = {0, 1, 0}};
  scene.appearance.lights = {red, place, moving};
  const Camera camera = testing::FrontCamera();
  const Frame frame = MakeCpuRenderer()->Render(scene, camera, WithPlanes());
  int clamped = 0;
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    if (frame.depth[i] == 0.0f) continue;
    const Vec3d n = frame.normal[i].cast<double>();
    const double a = std::max(0.0, Dot(n, Normalized(Vec3d{1, 0, -1})));
    const double b =
        3 * std::max(0.0, Dot(n, Normalized(Vec3d{-2, 1, -1} - PointAt(camera, frame, i))));
    const double c = std::max(0.0, Dot(n, Normalized(camera.right - camera.down)));
    const double green = 0.2 + 0.5 * (0.5 * b + c), blue = 0.2 + 0.5 * b;
    clamped += blue > 1;
    EXPECT_NEAR(frame.color[i].r, 0.2 + 0.5 * a, 1e-4);
    EXPECT_NEAR(frame.color[i].g, std::min(1.0, green), 1e-4);
    EXPECT_NEAR(frame.color[i].b, std::min(1.0, blue), 1e-4);
  }
  EXPECT_GT(clamped, 20);
}

// A small sphere above a large one: the shadow of a light from straight above is the disc under it;
// that of a point light is the disc inside the cone that touches it.
TEST(Shadows, FallWhereGeometrySays) {
  Scene scene = TwoSpheres();
  const Camera camera = Camera::LookAt({5, 4, 4}, {0, 1.3, 0}, {0, 1, 0}, 0.5, 240, 180);
  const Vec3d light{0.2, 8, 0.1};
  const Vec3d small{0, 5.2, 0};
  const auto renderer = MakeCpuRenderer();
  for (const bool far : {true, false}) {
    Light lamp;
    lamp.kind = far ? LightKind::kDirectional : LightKind::kPoint;
    lamp.to_light = {0, 1, 0};
    lamp.position = light;
    scene.appearance.lights = {lamp};
    const Frame frame = renderer->Render(scene, camera, WithPlanes());
    const float base = LinearFromRgb8({200, 200, 200}).x;
    int dark = 0, bright = 0;
    for (std::size_t i = 0; i < frame.color.size(); ++i) {
      if (frame.depth[i] == 0.0f) continue;
      const Vec3d p = PointAt(camera, frame, i);
      if (p.y > 2.2) continue;  // the small sphere itself
      const Vec3d to_light = far ? Vec3d{0, 1, 0} : Normalized(light - p);
      const double cosine = Dot(frame.normal[i].cast<double>(), to_light);
      if (cosine < 0.05) continue;
      const Vec3d offset = small - p;
      const double along = Dot(offset, to_light);
      const double across = std::sqrt(Dot(offset, offset) - along * along);
      if (std::abs(across - kSphere) < 2e-3) continue;  // on the boundary
      const bool shadowed = across < kSphere;
      (shadowed ? dark : bright) += 1;
      EXPECT_NEAR(frame.color[i].r, base * (0.1 + (shadowed ? 0 : 0.9 * cosine)), 2e-3)
          << far << " " << across;
    }
    EXPECT_GT(dark, 50);
    EXPECT_GT(bright, 2000);
  }
}

// What throws no shadow on itself: a sphere alone, lit from any side, is lit as without shadows.
TEST(Shadows, ASphereHasNoneOnItself) {
  Scene scene = testing::SceneOf(testing::OneMetaball(), kThreshold);
  const Camera camera = testing::FrontCamera(200, 150);
  const auto renderer = MakeCpuRenderer();
  for (int k = 0; k < 12; ++k) {
    Light light;
    light.kind = k % 2 == 0 ? LightKind::kDirectional : LightKind::kPoint;
    light.to_light = FibonacciDirection(k, 12);
    light.position = light.to_light * 2.0;
    scene.appearance.lights = {light};
    scene.appearance.shadows.enabled = false;
    const Frame lit = renderer->Render(scene, camera, {});
    scene.appearance.shadows.enabled = true;
    const Frame shadowed = renderer->Render(scene, camera, {});
    for (std::size_t i = 0; i < lit.color.size(); ++i) {
      EXPECT_EQ(lit.color[i].r, shadowed.color[i].r);
    }
  }
}

// n x n metaballs over the unit square: a floor, nearly flat.
CloudInput Floor(int n) {
  CloudInput input;
  input.uniform_radius = 2.5 / n;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) input.center.push_back({(i + 0.5) / n, (j + 0.5) / n, 0});
  }
  return input;
}

float MeanRed(const Frame& frame) {
  double sum = 0, n = 0;
  for (const Pixel& p : frame.color) {
    if (p.a == 0.0f) continue;
    sum += p.r;
    ++n;
  }
  return static_cast<float>(sum / n);
}

Camera Down(double x, double y, double width) {
  return Camera::LookAtOrthographic({x, y, 0.9}, {x, y, 0}, {0, 1, 0}, width, 24, 24);
}

TEST(AmbientOcclusion, OfAFloorIsOneAndOfACornerLess) {
  CloudInput input = Floor(40);
  const auto renderer = MakeCpuRenderer();
  const auto share = [&](const CloudInput& cloud, double x) {
    Scene scene = testing::SceneOf(cloud, 0.5);
    scene.lighting.ambient = 1;
    scene.lighting.diffuse = 0;
    const float open = MeanRed(renderer->Render(scene, Down(x, 0.5, 0.02), {}));
    scene.appearance.occlusion.enabled = true;
    scene.appearance.occlusion.directions = 256;
    scene.appearance.occlusion.distance = 0.4;
    return MeanRed(renderer->Render(scene, Down(x, 0.5, 0.02), {})) / open;
  };
  EXPECT_GT(share(input, 0.5), 0.97f);
  // A wall of the same kind, from the floor up, at x = 0.2: long and high beside the distance.
  for (int k = 1; k < 40; ++k) {
    for (int j = 0; j < 40; ++j) input.center.push_back({0.2, (j + 0.5) / 40, k / 40.0});
  }
  // Close to an endless wall half of the sky is hidden, cosine-weighted as well.
  EXPECT_NEAR(share(input, 0.25), 0.5f, 0.1f);
  EXPECT_GT(share(input, 0.35), share(input, 0.25) + 0.05f);
  // Farther from it than the distance it hides nothing.
  EXPECT_GT(share(input, 0.75), 0.97f);
}

// Rays are cast in groups of pixels, not in shares of threads.
TEST(Shadows, AreTheSameForAnyNumberOfThreads) {
  Scene scene = testing::SceneOf(testing::RandomBall(300, 0.4, 3, 17), kThreshold);
  Light sun{.kind = LightKind::kDirectional, .to_light = {-0.5, 1, -0.6}};
  Light lamp{.kind = LightKind::kPoint, .position = {0.5, 2, -1}};
  scene.appearance.lights = {sun, lamp};
  scene.appearance.shadows.enabled = true;
  scene.appearance.occlusion.enabled = true;
  scene.appearance.occlusion.directions = 16;
  const Camera perspective = testing::FrontCamera(100, 75);
  const Camera orthographic =
      Camera::LookAtOrthographic({2, 3, -4}, {0, 0, 0}, {0, 1, 0}, 3, 100, 75);
  const auto renderer = MakeCpuRenderer();
  for (const Camera& camera : {perspective, orthographic}) {
    RenderSettings settings;
    settings.threads = 1;
    const Frame one = renderer->Render(scene, camera, settings);
    EXPECT_EQ(one.stats.unresolved, 0u);
    for (const int threads : {2, 3}) {
      settings.threads = threads;
      const Frame more = renderer->Render(scene, camera, settings);
      for (std::size_t i = 0; i < one.color.size(); ++i) {
        ASSERT_EQ(one.color[i].r, more.color[i].r) << threads << " threads, pixel " << i;
      }
    }
  }
}

}  // namespace
}  // namespace sherd
