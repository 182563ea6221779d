// Appearances drawn by the kernels' bodies, against the CPU renderer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "cuda/host_loop.h"
#include "datasets_synthetic/peer_scenes.h"
#include "datasets_synthetic/random.h"
#include "metaball/appearance/uv_gradients.h"
#include "metaball/error.h"
#include "metaball/moving.h"
#include "metaball/renderer.h"

namespace sherd {
namespace {

// Metaballs on a bumpy sheet with a ball above it, which throws a shadow.
std::shared_ptr<const Cloud> MakeCloud() {
  static const std::shared_ptr<const Cloud> cloud = [] {
    synthetic::Rng random(3);
    CloudInput input;
    const auto add = [&](const Vec3d& p) {
      input.center.push_back(p);
      input.radius.push_back(random.Uniform(0.12, 0.2));
      input.color.push_back({static_cast<std::uint8_t>(random.Index(256)), 120, 60});
      input.threshold.push_back(random.Uniform(0.4, 0.8));
    };
    for (int i = 0; i < 40; ++i) {
      for (int k = 0; k < 40; ++k) {
        const double x = -1.2 + 0.06 * i, y = -1.2 + 0.06 * k;
        add({x, y, 0.08 * std::sin(5 * x) * std::cos(4 * y)});
      }
    }
    for (int i = 0; i < 500; ++i) {
      const Vec3d d{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)};
      add(Vec3d{0.1, 0, 0.7} + Normalized(d, {0, 0, 1}) * 0.3);
    }
    const std::size_t n = input.center.size();
    Channel uv("uv", ChannelType::kFloat32, 2, n);
    Channel vector("vector", ChannelType::kFloat32, 3, n);
    Channel map("normal_map", ChannelType::kOctahedral, 3, n);
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3d& p = input.center[i];
      uv.Set(i, {{static_cast<float>(p.x), static_cast<float>(0.4 * p.y)}});
      vector.Set(i, {{static_cast<float>(p.x), static_cast<float>(p.y), 2.0f}});
      map.Set(i, {{0.3f, static_cast<float>(p.x), 1.0f}});
    }
    input.channels = {uv, vector, map};
    auto made = std::make_shared<Cloud>(BuildCloud(input));
    AddUvGradients(made.get(), "uv");
    return made;
  }();
  return cloud;
}

std::shared_ptr<const ImagePyramid> MakeImage(ImageEncoding encoding) {
  Image image;
  image.width = 37;
  image.height = 22;
  image.encoding = encoding;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const auto r = static_cast<std::uint8_t>(6 * x), g = static_cast<std::uint8_t>(11 * y);
      if (encoding == ImageEncoding::kFloat) {
        image.floats.push_back({r / 255.0f, g / 255.0f, 0.5f});
      } else {
        image.bytes.push_back({r, g, static_cast<std::uint8_t>(200 - x)});
      }
    }
  }
  return std::make_shared<ImagePyramid>(std::move(image));
}

struct Case {
  std::string name;
  std::function<void(Scene*)> set;
  // Share of the pixels that may differ: the borders of shadows, rims.
  double off = 0.002;
};

std::vector<Case> MakeCases() {
  std::vector<Case> cases;
  const auto add = [&](std::string name, std::function<void(Scene*)> set, double off = 0.002) {
    cases.push_back({std::move(name), std::move(set), off});
  };
  const std::pair<Quantity, std::string> quantities[] = {
      {Quantity::kIntensity, "intensity"}, {Quantity::kField, "field"},
      {Quantity::kPosition, "position"},   {Quantity::kCameraDistance, "camera_distance"},
      {Quantity::kPointDistance, "point"}, {Quantity::kNormal, "normal"},
      {Quantity::kMortonKey, "morton"},    {Quantity::kChannel, "channel"}};
  for (const auto& [quantity, name] : quantities) {
    // A key of ten levels jumps from pixel to pixel.
    add("quantity_" + name, [quantity = quantity](Scene* s) {
      s->appearance.color = ColorSource::kQuantity;
      s->appearance.pseudo.quantity = quantity;
      s->appearance.pseudo.axis = {1, 2, 0.5};
      s->appearance.pseudo.channel = "vector";
      s->appearance.pseudo.component = quantity == Quantity::kChannel ? -1 : 0;
    });
  }
  const std::pair<ProjectionKind, std::string> projections[] = {
      {ProjectionKind::kPlanar, "planar"},
      {ProjectionKind::kCylindrical, "cylindrical"},
      {ProjectionKind::kSpherical, "spherical"},
      {ProjectionKind::kCubic, "cubic"}};
  const std::pair<ImageEncoding, std::string> encodings[] = {{ImageEncoding::kSrgb8, "srgb"},
                                                             {ImageEncoding::kData8, "data"},
                                                             {ImageEncoding::kFloat, "float"}};
  for (std::size_t k = 0; k < std::size(projections); ++k) {
    const auto [kind, name] = projections[k];
    const auto encoding = encodings[k % std::size(encodings)].first;
    add(
        "texture_" + name,
        [kind = kind, encoding](Scene* s) {
          s->appearance.color = ColorSource::kTexture;
          s->appearance.texture.image = MakeImage(encoding);
          s->appearance.texture.projection = FitProjection(*s->cloud, kind, {0, 0, -1}, {0, 1, 0});
        },
        0.006);
  }
  const auto by_channel = [](TextureLookup* lookup, ImageEncoding encoding) {
    lookup->image = MakeImage(encoding);
    lookup->coordinates = TextureCoordinates::kChannel;
    lookup->uv = {"uv", false};
    lookup->repeat_u = true;
  };
  add(
      "texture_of_a_channel",
      [by_channel](Scene* s) {
        s->appearance.color = ColorSource::kTexture;
        by_channel(&s->appearance.texture, ImageEncoding::kSrgb8);
      },
      0.006);
  add("volume", [](Scene* s) {
    auto volume = std::make_shared<VolumeTexture>();
    volume->nx = 3;
    volume->ny = 4;
    volume->nz = 2;
    for (int i = 0; i < 24; ++i)
      volume->voxels.push_back({static_cast<std::uint8_t>(10 * i), 90, 7});
    volume->min = {-1, -1, -0.5};
    s->appearance.color = ColorSource::kVolume;
    s->appearance.volume = volume;
  });
  add(
      "normals_of_influence", [](Scene* s) { s->appearance.normal = NormalSource::kInfluence; },
      0.006);
  add("normal_map_of_a_channel",
      [](Scene* s) { s->appearance.normal_map.source = NormalMapSource::kChannel; });
  add(
      "normal_map_of_an_image",
      [by_channel](Scene* s) {
        s->appearance.normal_map.source = NormalMapSource::kImage;
        by_channel(&s->appearance.normal_map.lookup, ImageEncoding::kData8);
      },
      0.006);
  const auto light_it = [](Scene* s) {
    s->appearance.lights = {
        Light{.kind = LightKind::kDirectional, .to_light = {0.6, 0.2, 1}, .intensity = 0.6},
        Light{.kind = LightKind::kPoint, .position = {-2, 1, 3}, .color = {1, 0.4, 0.2}},
        Light{.kind = LightKind::kDirectional, .to_light = {1, 0, -1}, .with_camera = true},
        Light{.kind = LightKind::kCamera, .intensity = 0.2}};
  };
  add("four_lights", light_it);
  add(
      "shadows",
      [light_it](Scene* s) {
        light_it(s);
        s->appearance.shadows.enabled = true;
      },
      0.02);
  add(
      "occlusion",
      [](Scene* s) {
        s->appearance.occlusion = {.enabled = true, .directions = 24, .distance = 0.6};
      },
      0.02);
  for (const ThresholdMode mode :
       {ThresholdMode::kBlended, ThresholdMode::kSummed, ThresholdMode::kGated}) {
    // Summed thresholds jump: shadows are ragged there.
    add(
        "shadows_and_occlusion_" + NameOf(mode),
        [light_it, mode](Scene* s) {
          light_it(s);
          if (mode == ThresholdMode::kSummed) {
            auto low = std::make_shared<Cloud>(*s->cloud);
            for (float& threshold : low->threshold) threshold *= 0.03f;
            s->cloud = low;
          }
          s->surface.mode = mode;
          s->appearance.shadows.enabled = true;
          s->appearance.occlusion = {.enabled = true, .directions = 8};
        },
        mode == ThresholdMode::kSummed ? 0.2 : 0.03);
  }
  add(
      "shadows_of_another_density",
      [light_it](Scene* s) {
        light_it(s);
        s->surface.density = ParseDensity("wyvill");
        s->appearance.shadows.enabled = true;
      },
      0.02);
  add("filter", [](Scene* s) { s->appearance.filter = 5; });
  add(
      "all_at_once",
      [light_it, by_channel](Scene* s) {
        light_it(s);
        s->appearance.color = ColorSource::kTexture;
        by_channel(&s->appearance.texture, ImageEncoding::kSrgb8);
        s->appearance.normal = NormalSource::kInfluence;
        s->appearance.shadows.enabled = true;
        s->appearance.occlusion = {.enabled = true, .directions = 8};
        s->appearance.filter = 3;
      },
      0.03);
  return cases;
}

const Case& CaseNamed(const std::string& name) {
  static const std::vector<Case> cases = MakeCases();
  return *std::find_if(cases.begin(), cases.end(), [&](const Case& c) { return c.name == name; });
}

Scene SceneOfCase(const std::string& name) {
  Scene scene;
  scene.cloud = MakeCloud();
  CaseNamed(name).set(&scene);
  return scene;
}

const Camera kCamera = Camera::LookAt({0.8, -1.6, 2.6}, {0, 0, 0.1}, {0, 0, 1}, 0.9, 84, 60);

std::size_t PixelsOff(const Frame& a, const Frame& b, float tolerance) {
  std::size_t off = 0;
  for (std::size_t i = 0; i < a.color.size(); ++i) {
    const Pixel &p = a.color[i], &q = b.color[i];
    const float worst = std::max(
        {std::abs(p.r - q.r), std::abs(p.g - q.g), std::abs(p.b - q.b), std::abs(p.a - q.a)});
    off += !(worst <= tolerance);
  }
  return off;
}

class AppearanceCases : public ::testing::TestWithParam<std::string> {};

TEST_P(AppearanceCases, AreThoseOfTheCpu) {
  const Scene scene = SceneOfCase(GetParam());
  Scene plain = scene;
  plain.appearance = {};
  for (const int supersample : {1, 2}) {
    RenderSettings settings;
    settings.supersample = supersample;
    const Frame cpu = MakeCpuRenderer()->Render(scene, kCamera, settings);
    const Frame own = MakeHostLoopRenderer()->Render(scene, kCamera, settings);
    ASSERT_EQ(own.color.size(), cpu.color.size());
    EXPECT_TRUE(own.depth.empty() && own.normal.empty() && own.channels.empty() && own.uv.empty());
    EXPECT_LE(PixelsOff(cpu, own, 0.01f),
              CaseNamed(GetParam()).off * static_cast<double>(cpu.color.size()));
    // It is not what is drawn without it.
    const Frame without = MakeCpuRenderer()->Render(plain, kCamera, settings);
    EXPECT_GT(PixelsOff(own, without, 0.01f), 400u);
  }
}

INSTANTIATE_TEST_SUITE_P(All, AppearanceCases, ::testing::ValuesIn([] {
                           std::vector<std::string> names;
                           for (const Case& c : MakeCases()) names.push_back(c.name);
                           return names;
                         }()),
                         [](const auto& param_info) { return param_info.param; });

TEST(PipelineAppearance, PartsOfAPictureMakeTheSamePicture) {
  const Scene scene = SceneOfCase("all_at_once");
  RenderSettings settings;
  settings.planes.depth = true;
  settings.planes.channels = {"vector"};
  const Frame whole = MakeHostLoopRenderer()->Render(scene, kCamera, settings);
  HostLoopOptions options;
  options.memory_bytes = 900'000;
  const Frame parts = MakeHostLoopRenderer(options)->Render(scene, kCamera, settings);
  EXPECT_LT(parts.stats.bytes, options.memory_bytes);
  EXPECT_GT(whole.stats.bytes, options.memory_bytes);
  EXPECT_LE(PixelsOff(whole, parts, 1e-3f), whole.color.size() / 200);
  ASSERT_EQ(parts.channels.size(), 1u);
  for (std::size_t i = 0; i < whole.depth.size(); ++i) {
    ASSERT_NEAR(whole.depth[i], parts.depth[i], 1e-4);
    ASSERT_NEAR(whole.channels[0].values[3 * i], parts.channels[0].values[3 * i], 1e-3);
  }
}

TEST(PipelineAppearance, ShadowsFollowTheRadiusAndACloudThatLostItsOrder) {
  Scene scene = SceneOfCase("shadows");
  const auto renderer = MakeHostLoopRenderer(), cpu = MakeCpuRenderer();
  const auto expect_as_cpu = [&] {
    const Frame own = renderer->Render(scene, kCamera, {});
    EXPECT_LE(PixelsOff(cpu->Render(scene, kCamera, {}), own, 0.01f), own.color.size() / 50);
  };
  expect_as_cpu();
  scene.surface.radius_scale = 1.3;
  expect_as_cpu();
  auto shuffled = std::make_shared<Cloud>(*scene.cloud);
  const std::size_t n = shuffled->size();
  for (std::size_t i = 0; i < n; ++i) {  // a permutation far from any order in space
    const std::size_t k = i * 1237 % n;
    shuffled->center[i] = scene.cloud->center[k];
    shuffled->radius[i] = scene.cloud->radius[k];
    shuffled->color[i] = scene.cloud->color[k];
  }
  scene.cloud = shuffled;
  expect_as_cpu();
}

TEST(PipelineAppearance, WhatCannotBeDrawnIsRefusedInWords) {
  Scene scene = SceneOfCase("volume");
  scene.appearance.volume = nullptr;
  EXPECT_THROW(MakeHostLoopRenderer()->Render(scene, kCamera, {}), Error);
  scene = SceneOfCase("filter");
  scene.appearance.filter = 4;
  EXPECT_THROW(MakeHostLoopRenderer()->Render(scene, kCamera, {}), Error);
}

// A cloud that moved is brought over anew, though it is the same object.
TEST(PipelineAppearance, SeesThatACloudMoved) {
  CloudInput input;
  input.center = {{0, 0, 0}, {0.5, 0, 0}};
  input.uniform_radius = 1;
  MovingCloud moving(input);
  Scene scene;
  scene.cloud = moving.cloud();
  const Camera camera = Camera::LookAt({0, 0, -6}, {0, 0, 0}, {0, 1, 0}, 0.9, 60, 40);
  const auto renderer = MakeHostLoopRenderer();
  const auto cpu = MakeCpuRenderer();
  std::uint64_t before = 0;
  const auto expect_new_picture = [&] {
    const std::uint64_t hits = renderer->Render(scene, camera, {}).stats.hits;
    EXPECT_NEAR(static_cast<double>(hits),
                static_cast<double>(cpu->Render(scene, camera, {}).stats.hits), 2);
    EXPECT_GT(std::max(hits, before) - std::min(hits, before), 20u);
    before = hits;
  };
  expect_new_picture();
  input.center[1] = {1.5, 0, 0};
  moving.SetPositions(input.center);
  expect_new_picture();
  moving.SetUniformRadius(0.5);
  expect_new_picture();
}

}  // namespace
}  // namespace sherd
