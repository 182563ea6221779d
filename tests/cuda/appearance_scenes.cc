#include "appearance_scenes.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "datasets_synthetic/random.h"
#include "metaball/appearance/uv_gradients.h"
#include "metaball/cloud.h"

namespace sherd {
namespace {

// Metaballs on a bumpy sheet with a ball above it, which throws a shadow.
std::shared_ptr<const Cloud> SheetWithBall() {
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

struct Case {
  std::string name;
  std::function<void(Scene*)> set;
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
          s->appearance.texture.image = MakeRampImage(encoding);
          s->appearance.texture.projection = FitProjection(*s->cloud, kind, {0, 0, -1}, {0, 1, 0});
        },
        0.006);
  }
  const auto by_channel = [](TextureLookup* lookup, ImageEncoding encoding) {
    lookup->image = MakeRampImage(encoding);
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

}  // namespace

std::shared_ptr<const ImagePyramid> MakeRampImage(ImageEncoding encoding) {
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

std::vector<FeatureScene> MakeAppearanceScenes(int width, int height) {
  const Camera camera =
      Camera::LookAt({0.8, -1.6, 2.6}, {0, 0, 0.1}, {0, 0, 1}, 0.9, width, height);
  std::vector<FeatureScene> scenes;
  for (const Case& c : MakeCases()) {
    FeatureScene added{.name = c.name, .scene = {}, .camera = camera, .planes = {}};
    added.scene.cloud = SheetWithBall();
    c.set(&added.scene);
    added.colors_off = c.off;
    scenes.push_back(std::move(added));
  }
  return scenes;
}

std::shared_ptr<Cloud> MakeChannelCloud(double radius, double spread) {
  constexpr std::size_t kMetaballs = 1500;
  synthetic::Rng random(7);
  CloudInput input;
  input.uniform_radius = radius;
  Channel height("height", ChannelType::kFloat32, 1, kMetaballs);
  Channel pair("pair", ChannelType::kUnorm16, 2, kMetaballs, -3, 5);
  Channel four("four", ChannelType::kUnorm8, 4, kMetaballs, 0, 1);
  Channel direction("direction", ChannelType::kOctahedral, 3, kMetaballs);
  Channel uv("uv", ChannelType::kFloat32, 2, kMetaballs);
  for (std::size_t i = 0; i < kMetaballs; ++i) {
    const Vec3d p = Normalized(
        Vec3d{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)}, {0, 0, 1});
    input.center.push_back(p);
    if (spread > 1) input.radius.push_back(radius * std::pow(spread, -random.Uniform()));
    input.color.push_back({static_cast<std::uint8_t>(random.Index(256)), 90, 200});
    input.threshold.push_back(random.Uniform(0.3, 0.9));
    height.Set(i, {{static_cast<float>(p.y)}});
    pair.Set(i, {{static_cast<float>(p.x), static_cast<float>(4 * p.z)}});
    four.Set(i, {{0.2f, static_cast<float>(random.Uniform()), 0.7f, 1.0f}});
    direction.Set(i, {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}});
    const double around = std::atan2(p.z, p.x) / (2 * std::numbers::pi) + 0.5;
    uv.Set(i, {{static_cast<float>(around), static_cast<float>(0.5 * p.y + 0.5)}});
  }
  input.channels = {height, pair, four, direction, uv};
  auto cloud = std::make_shared<Cloud>(BuildCloud(input));
  AddUvGradients(cloud.get(), "uv", true);
  return cloud;
}

Planes EveryPlane() {
  Planes planes;
  planes.depth = planes.normal = planes.id = planes.light = true;
  planes.weight = planes.intensity = planes.influence = true;
  planes.channels = {"four", "height", "direction", "pair"};
  planes.uv = {{"uv", true}};
  return planes;
}

std::vector<FeatureScene> MakePlaneScenes(int width, int height) {
  struct Kind {
    const char* name;
    ThresholdMode mode;
    double radius, spread;
  };
  using enum ThresholdMode;
  const Kind kinds[] = {{"uniform", kUniform, 0.15, 1},
                        {"own_radii", kUniform, 0.2, 2},
                        {"in_doubles", kUniform, 0.2, 120},
                        {"blended", kBlended, 0.2, 2},
                        {"blended_in_doubles", kBlended, 0.2, 120},
                        {"summed", kSummed, 0.2, 2},
                        {"gated", kGated, 0.2, 2}};
  const Camera camera = Camera::LookAt({0.4, 0.6, -3}, {0, 0, 0}, {0, 1, 0}, 0.9, width, height);
  std::vector<FeatureScene> scenes;
  for (const Kind& kind : kinds) {
    FeatureScene added{.name = std::string("planes_") + kind.name,
                       .scene = {},
                       .camera = camera,
                       .planes = EveryPlane()};
    const std::shared_ptr<Cloud> cloud = MakeChannelCloud(kind.radius, kind.spread);
    if (kind.mode == kSummed) {
      for (float& threshold : cloud->threshold) threshold *= 0.03f;
    }
    added.scene.cloud = cloud;
    added.scene.surface.mode = kind.mode;
    added.depth_tolerance = 1e-4 * kind.radius;
    scenes.push_back(std::move(added));
  }
  return scenes;
}

}  // namespace sherd
