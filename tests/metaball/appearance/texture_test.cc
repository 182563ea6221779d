// Textures in the picture: detail, filtering, seams, and three-dimensional ones.
#include <gtest/gtest.h>

#include <cmath>

#include "metaball/appearance/bake.h"
#include "metaball/appearance/uv_gradients.h"
#include "metaball/error.h"
#include "metaball/renderer.h"
#include "tests/metaball/appearance/sheet.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

using testing::DownOn;
using testing::Sheet;
using testing::WithPlanes;

// Squares of `pixels` pixels a side.
std::shared_ptr<ImagePyramid> Checker(int squares, int pixels) {
  Image image;
  image.width = image.height = squares * pixels;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t v = (x / pixels + y / pixels) % 2 == 0 ? 255 : 0;
      image.bytes.push_back({v, v, v});
    }
  }
  return std::make_shared<ImagePyramid>(std::move(image));
}

// How well a picture of the sheet's part [x0, x0 + width]^2 shows the checker: correlation with it,
// and the standard deviation over that of the checker.
struct Likeness {
  double correlation = 0, contrast = 0;
};

Likeness LikenessTo(const Frame& frame, double x0, double y0, double width, int squares) {
  double n = 0, sum = 0, sum2 = 0, cross = 0, ideal_sum = 0;
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      const Pixel& p = frame.color[static_cast<std::size_t>(y) * frame.width + x];
      if (p.a == 0.0f) continue;
      const double u = x0 + (x + 0.5) / frame.width * width;
      const double v = y0 + (1 - (y + 0.5) / frame.height) * width;
      const int column = static_cast<int>(u * squares);
      const int row = static_cast<int>((1 - v) * squares);
      const double ideal = (column + row) % 2 == 0 ? 0.5 : -0.5;
      ++n;
      sum += p.r;
      sum2 += p.r * p.r;
      cross += p.r * ideal;
      ideal_sum += ideal;
    }
  }
  const double deviation = std::sqrt(std::max(sum2 / n - sum / n * sum / n, 0.0));
  const double covariance = cross / n - sum / n * ideal_sum / n;
  return {deviation > 0 ? covariance / (deviation * 0.5) : 0, deviation / 0.5};
}

// Five squares of a checker lie between two metaballs (thesis figures 4.7, 4.14: unreadable when
// each metaball has one colour). Looked up at the surface point they are all there.
TEST(Texture, ShowsDetailFinerThanTheMetaballs) {
  CloudInput input = Sheet(100);
  Channel uv("uv", ChannelType::kFloat32, 2, input.center.size());
  for (std::size_t i = 0; i < input.center.size(); ++i) {
    uv.Set(i, {{static_cast<float>(input.center[i].x), static_cast<float>(input.center[i].y)}});
  }
  input.channels = {uv};
  Cloud cloud = BuildCloud(input);
  AddUvGradients(&cloud, "uv");
  Scene scene;
  scene.cloud = std::make_shared<Cloud>(cloud);
  scene.surface.threshold = 0.01;
  scene.lighting.unlit = true;
  TextureLookup lookup;
  lookup.image = Checker(500, 6);
  lookup.projection.center = {0.5, 0.5, 0};
  const Camera camera = DownOn(0.4, 0.3, 0.1, 300);
  const auto renderer = MakeCpuRenderer();
  for (const TextureCoordinates from :
       {TextureCoordinates::kChannel, TextureCoordinates::kProjection}) {
    lookup.coordinates = from;
    scene.appearance.color = ColorSource::kTexture;
    scene.appearance.texture = lookup;
    const Likeness surface = LikenessTo(renderer->Render(scene, camera, {}), 0.4, 0.3, 0.1, 500);
    EXPECT_GT(surface.correlation, 0.95);
    EXPECT_GT(surface.contrast, 0.9);

    Cloud baked = cloud;
    baked.color = TextureColors(cloud, lookup);
    Scene thesis = scene;
    thesis.cloud = std::make_shared<Cloud>(baked);
    thesis.appearance = {};
    const Likeness metaballs = LikenessTo(renderer->Render(thesis, camera, {}), 0.4, 0.3, 0.1, 500);
    EXPECT_LT(std::abs(metaballs.correlation), 0.2);
  }
}

// Far away the squares melt into an even grey instead of flickering.
TEST(Texture, IsFilteredForThePixel) {
  Scene scene = testing::SceneOf(Sheet(100), 0.01);
  scene.lighting.unlit = true;
  scene.appearance.color = ColorSource::kTexture;
  scene.appearance.texture.image = Checker(500, 4);
  scene.appearance.texture.projection.center = {0.5, 0.5, 0};
  const Frame frame = MakeCpuRenderer()->Render(scene, DownOn(0.1, 0.1, 0.8, 70), {});
  for (const Pixel& p : frame.color) {
    ASSERT_EQ(p.a, 1.0f);
    EXPECT_NEAR(p.r, 0.5f, 0.05f);
  }
}

// Coordinates that wrap: nowhere does the picture run backwards through the whole image.
TEST(Texture, HasNoSeam) {
  CloudInput input;
  input.uniform_radius = 0.12;
  constexpr int kAround = 60;
  for (int k = 0; k < 30; ++k) {
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * M_PI * (i + 0.5 * (k % 2)) / kAround;
      input.center.push_back({std::sin(angle), 0.08 * k, -std::cos(angle)});
    }
  }
  Channel uv("uv", ChannelType::kFloat32, 2, input.center.size());
  for (std::size_t i = 0; i < input.center.size(); ++i) {
    const Vec3d& p = input.center[i];
    const double u = std::atan2(p.x, -p.z) / (2 * M_PI) + 1.2;  // the seam is in view
    uv.Set(i, {{static_cast<float>(u - std::floor(u)), static_cast<float>(p.y / 2.4)}});
  }
  input.channels = {uv};
  Cloud cloud = BuildCloud(input);
  AddUvGradients(&cloud, "uv", true);
  Scene scene;
  scene.cloud = std::make_shared<Cloud>(cloud);
  scene.surface.threshold = 0.3;
  scene.lighting.unlit = true;
  // A ramp that closes: red and green are cosine and sine of the angle.
  Image ramp;
  ramp.width = 512;
  ramp.height = 1;
  ramp.encoding = ImageEncoding::kFloat;
  for (int i = 0; i < 512; ++i) {
    const double angle = 2 * M_PI * (i + 0.5) / 512;
    ramp.floats.push_back({static_cast<float>(0.5 + 0.5 * std::cos(angle)),
                           static_cast<float>(0.5 + 0.5 * std::sin(angle)), 0});
  }
  TextureLookup& lookup = scene.appearance.texture;
  scene.appearance.color = ColorSource::kTexture;
  lookup.image = std::make_shared<ImagePyramid>(std::move(ramp));
  lookup.coordinates = TextureCoordinates::kChannel;
  lookup.uv = {"uv", true};
  const Camera camera = Camera::LookAt({0, 1.2, -4}, {0, 1.2, 0}, {0, 1, 0}, 0.7, 200, 150);
  const auto renderer = MakeCpuRenderer();
  const Frame by_channel = renderer->Render(scene, camera, WithPlanes());
  lookup.coordinates = TextureCoordinates::kProjection;
  lookup.projection.kind = ProjectionKind::kCylindrical;
  lookup.projection.right = {1, 0, 0};
  lookup.projection.forward = {0, 0, 1};
  const Frame by_projection = renderer->Render(scene, camera, WithPlanes());
  int hits = 0;
  for (std::size_t i = 0; i < by_channel.color.size(); ++i) {
    if (by_channel.depth[i] == 0.0f) continue;
    ++hits;
    const RayD ray = RayThrough(camera, i % 200 + 0.5, i / 200 + 0.5);
    const Vec3d p = ray.origin + ray.direction * double{by_channel.depth[i]};
    const double angle = std::atan2(p.x, -p.z);
    EXPECT_NEAR(by_channel.color[i].r, 0.5 + 0.5 * std::cos(angle + 0.4 * M_PI), 0.03);
    EXPECT_NEAR(by_channel.color[i].g, 0.5 + 0.5 * std::sin(angle + 0.4 * M_PI), 0.03);
    EXPECT_NEAR(by_projection.color[i].r, 0.5 + 0.5 * std::cos(angle + M_PI), 0.03);
  }
  EXPECT_GT(hits, 5000);
}

TEST(VolumeTexture, ColoursTheSurfacePoint) {
  Scene scene = testing::SceneOf(testing::RandomBall(100, 0.5, 2, 1));
  scene.lighting.unlit = true;
  auto volume = std::make_shared<VolumeTexture>();
  volume->nx = volume->ny = volume->nz = 2;
  volume->min = {-2, -2, -2};
  volume->max = {2, 2, 2};
  for (int i = 0; i < 8; ++i) {
    volume->voxels.push_back(
        {static_cast<std::uint8_t>(30 * i), static_cast<std::uint8_t>(255 - i), 9});
  }
  scene.appearance.color = ColorSource::kVolume;
  EXPECT_THROW(MakeCpuRenderer()->Render(scene, testing::FrontCamera(), {}), Error);
  scene.appearance.volume = volume;
  const Camera camera = testing::FrontCamera();
  const Frame frame = MakeCpuRenderer()->Render(scene, camera, WithPlanes());
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    if (frame.depth[i] == 0.0f) continue;
    const RayD ray = RayThrough(camera, i % frame.width + 0.5, i / frame.width + 0.5);
    const Vec3f expected = volume->At(ray.origin + ray.direction * double{frame.depth[i]});
    EXPECT_NEAR(frame.color[i].r, expected.x, 1e-5);
    EXPECT_NEAR(frame.color[i].g, expected.y, 1e-5);
  }
}

}  // namespace
}  // namespace sherd
