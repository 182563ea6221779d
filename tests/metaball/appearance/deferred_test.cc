// Colours and normals made by the passes over the frame.
#include "metaball/appearance/deferred.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "metaball/appearance/pseudo_color.h"
#include "metaball/error.h"
#include "tests/metaball/appearance/sheet.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

using testing::DownOn;
using testing::Sheet;
using testing::WithPlanes;

bool SameColors(const Frame& a, const Frame& b) {
  return a.color.size() == b.color.size() &&
         std::memcmp(a.color.data(), b.color.data(), a.color.size() * sizeof(Pixel)) == 0;
}

TEST(Deferred, DefaultScenesNeedNone) {
  Scene scene = testing::SceneOf(testing::OneMetaball());
  EXPECT_FALSE(NeedsDeferredPasses(scene, {}));
  EXPECT_TRUE(NeedsDeferredPasses(scene, {.light = true}));
  scene.lighting.unlit = true;
  scene.appearance.shadows.enabled = true;  // nothing to shade
  EXPECT_FALSE(NeedsDeferredPasses(scene, {}));
  scene.lighting.unlit = false;
  EXPECT_TRUE(NeedsDeferredPasses(scene, {}));
}

// One light given as a light is the light of the scene.
TEST(Deferred, OneLightEqualsTheTracersOwn) {
  Scene scene = testing::SceneOf(testing::RandomBall(150, 0.4, 2, 2));
  const Camera camera = testing::FrontCamera();
  const auto renderer = MakeCpuRenderer();
  for (const bool headlight : {true, false}) {
    scene.lighting.headlight = headlight;
    scene.lighting.to_light = {0.4, 1, -0.7};
    scene.appearance = {};
    const Frame expected = renderer->Render(scene, camera, {});
    Light light;
    light.kind = headlight ? LightKind::kCamera : LightKind::kDirectional;
    light.to_light = scene.lighting.to_light;
    scene.appearance.lights = {light};
    const Frame frame = renderer->Render(scene, camera, {});
    EXPECT_TRUE(frame.depth.empty() && frame.normal.empty());
    for (std::size_t i = 0; i < frame.color.size(); ++i) {
      EXPECT_NEAR(frame.color[i].r, expected.color[i].r, 1e-5);
      EXPECT_NEAR(frame.color[i].b, expected.color[i].b, 1e-5);
      EXPECT_EQ(frame.color[i].a, expected.color[i].a);
    }
  }
}

// The light plane is what the unlit colours are multiplied by, beyond 1 as well.
TEST(Deferred, LightIsThePlaneThatUnlitColorsAreMultipliedBy) {
  Scene scene = testing::SceneOf(testing::RandomBall(150, 0.4, 2, 2));
  const Camera camera = testing::FrontCamera();
  Light sun;
  sun.kind = LightKind::kDirectional;
  sun.to_light = {0.4, 1, -0.7};
  sun.intensity = 3;
  scene.appearance.lights = {sun};
  scene.appearance.shadows.enabled = true;
  RenderSettings settings;
  settings.planes.light = true;
  const Frame lit = MakeCpuRenderer()->Render(scene, camera, settings);
  EXPECT_TRUE(lit.depth.empty() && lit.normal.empty() && lit.id.empty());
  scene.lighting.unlit = true;
  const Frame unlit = MakeCpuRenderer()->Render(scene, camera, settings);
  ASSERT_EQ(lit.light.size(), lit.color.size());
  std::size_t bright = 0, dark = 0;
  for (std::size_t i = 0; i < lit.color.size(); ++i) {
    const Vec3f &light = lit.light[i], nothing{};
    if (lit.color[i].a == 0) {
      EXPECT_EQ(light, nothing);
      EXPECT_EQ(unlit.light[i], nothing);
      continue;
    }
    EXPECT_EQ(unlit.light[i], (Vec3f{1, 1, 1}));
    EXPECT_FLOAT_EQ(lit.color[i].r, std::min(1.0f, unlit.color[i].r * light.x));
    EXPECT_FLOAT_EQ(lit.color[i].b, std::min(1.0f, unlit.color[i].b * light.z));
    bright += light.x > 1;
    dark += light.x == static_cast<float>(scene.lighting.ambient);
  }
  EXPECT_GT(bright, 100u);
  EXPECT_GT(dark, 100u);
}

TEST(Deferred, QuantitiesAreThoseOfTheSurfacePoint) {
  CloudInput input = testing::RandomBall(200, 0.4, 2, 9);
  Channel age("age", ChannelType::kFloat32, 2, input.center.size());
  for (std::size_t i = 0; i < input.center.size(); ++i) {
    age.Set(i, {{static_cast<float>(input.center[i].x), 4.0f}});
  }
  input.channels = {age};
  Scene scene = testing::SceneOf(input);
  scene.lighting.unlit = true;
  const Camera camera = testing::FrontCamera();
  const auto renderer = MakeCpuRenderer();
  RenderSettings settings = WithPlanes();
  settings.planes.intensity = true;
  settings.planes.channels = {"age"};
  const Frame plain = renderer->Render(scene, camera, settings);

  scene.appearance.color = ColorSource::kQuantity;
  PseudoColor& pseudo = scene.appearance.pseudo;
  pseudo.map = std::make_shared<ColorMap>("ramp", std::vector<Rgb8>{{40, 40, 40}, {250, 250, 250}});
  pseudo.axis = {0, 2, 0};
  pseudo.point = {5, 0, 0};
  pseudo.channel = "age";
  struct Case {
    Quantity quantity;
    int component;
    ColorRange range;
  };
  const Case cases[] = {
      {Quantity::kIntensity, 0, {0, 0.7}},      {Quantity::kPosition, 0, {-1, 1}},
      {Quantity::kCameraDistance, 0, {2.5, 5}}, {Quantity::kPointDistance, 0, {3, 7}},
      {Quantity::kChannel, 0, {-1, 1}},         {Quantity::kChannel, -1, {3, 5}}};
  for (const Case& c : cases) {
    pseudo.quantity = c.quantity;
    pseudo.component = c.component;
    pseudo.range = c.range;
    const Frame frame = renderer->Render(scene, camera, {});
    int hits = 0;
    for (std::size_t i = 0; i < frame.color.size(); ++i) {
      if (plain.depth[i] == 0.0f) {
        EXPECT_EQ(frame.color[i].a, 0.0f);
        continue;
      }
      ++hits;
      const RayD ray = RayThrough(camera, i % frame.width + 0.5, i / frame.width + 0.5);
      const Vec3d p = ray.origin + ray.direction * double{plain.depth[i]};
      double value = 0;
      const double age_x = plain.channels[0].values[2 * i];
      if (c.quantity == Quantity::kIntensity) value = plain.intensity[i];
      if (c.quantity == Quantity::kPosition) value = p.y;
      if (c.quantity == Quantity::kCameraDistance) value = plain.depth[i];
      if (c.quantity == Quantity::kPointDistance) value = Length(p - pseudo.point);
      if (c.quantity == Quantity::kChannel) value = c.component == 0 ? age_x : std::hypot(age_x, 4);
      const Vec3f expected = pseudo.map->At((value - c.range.lo) / (c.range.hi - c.range.lo));
      EXPECT_NEAR(frame.color[i].r, expected.x, 1e-4);
      EXPECT_GT(frame.color[i].g, 0.01f);  // nothing is black but what the map says
    }
    EXPECT_GT(hits, 500);
  }
  pseudo.component = 2;
  EXPECT_THROW(renderer->Render(scene, camera, {}), Error);
  pseudo.channel = "year";
  EXPECT_THROW(renderer->Render(scene, camera, {}), Error);
}

TEST(Deferred, NormalsAndMortonKeysAsColours) {
  Scene scene = testing::SceneOf(testing::RandomBall(200, 0.4, 2, 9));
  scene.lighting.unlit = true;
  scene.appearance.color = ColorSource::kQuantity;
  scene.appearance.pseudo.quantity = Quantity::kNormal;
  const Frame frame = MakeCpuRenderer()->Render(scene, testing::FrontCamera(), WithPlanes());
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    if (frame.depth[i] == 0.0f) continue;
    EXPECT_NEAR(SrgbFromLinear(frame.color[i].g), 0.5f * frame.normal[i].y + 0.5f, 1e-4);
  }
  // The upper half of the cube along z has the key's highest bit: the upper half of the map.
  scene.appearance.pseudo.quantity = Quantity::kMortonKey;
  scene.appearance.pseudo.map =
      std::make_shared<ColorMap>("grey", std::vector<Rgb8>{{60, 60, 60}, {200, 200, 200}});
  const Camera camera = Camera::LookAt({4, 0.5, 0.3}, {0, 0, 0}, {0, 1, 0}, 0.9, 96, 64);
  const Frame keys = MakeCpuRenderer()->Render(scene, camera, WithPlanes());
  const Box3f box = scene.cloud->CenterBox();
  const Vec3f size = box.max - box.min;
  const double side = std::max({size.x, size.y, size.z}) * scene.cloud->frame.unit;
  const double middle = scene.cloud->frame.WorldFromLocal(box.min).z + 0.5 * side;
  const float half = scene.appearance.pseudo.map->At(0.5).x;
  int upper = 0, lower = 0;
  for (std::size_t i = 0; i < keys.color.size(); ++i) {
    if (keys.depth[i] == 0.0f) continue;
    const RayD ray = RayThrough(camera, i % keys.width + 0.5, i / keys.width + 0.5);
    const double z = (ray.origin + ray.direction * double{keys.depth[i]}).z - middle;
    if (std::abs(z) < 1e-5) continue;
    z > 0 ? ++upper : ++lower;
    EXPECT_EQ(z > 0, keys.color[i].r >= half - 1e-6f);
  }
  EXPECT_GT(upper, 20);
  EXPECT_GT(lower, 20);
}

// The range found for a quantity does not hang on strays, nor on the part that is drawn.
TEST(Deferred, AutomaticRangesAreRobust) {
  CloudInput input = Sheet(40);
  input.center.push_back({0.5, 0.5, 900});
  Scene scene = testing::SceneOf(input);
  scene.appearance.color = ColorSource::kQuantity;
  scene.appearance.pseudo.quantity = Quantity::kPosition;
  scene.appearance.pseudo.axis = {1, 0, 0};
  const Camera camera = DownOn(0, 0, 1, 32);
  const ColorRange x = RangeOf(scene, camera);
  EXPECT_NEAR(x.lo, 0.02, 0.02);
  EXPECT_NEAR(x.hi, 0.98, 0.02);
  scene.appearance.pseudo.axis = {0, 0, 1};
  const ColorRange z = RangeOf(scene, camera);
  EXPECT_LT(z.hi, 1);
  EXPECT_LT(z.lo, z.hi);
  scene.appearance.pseudo.range = ColorRange{2, 2};
  EXPECT_THROW(RangeOf(scene, camera), Error);
}

// thesis 3.5: for one metaball both normals are the sphere's; where directions cancel the gradient
// steps in, and everything is finite.
TEST(Normals, ByInfluenceAreFiniteAndRightForOneMetaball) {
  Scene scene = testing::SceneOf(testing::OneMetaball());
  const Camera camera = testing::FrontCamera();
  const Frame gradient = MakeCpuRenderer()->Render(scene, camera, {});
  scene.appearance.normal = NormalSource::kInfluence;
  const Frame influence = MakeCpuRenderer()->Render(scene, camera, {});
  for (std::size_t i = 0; i < gradient.color.size(); ++i) {
    EXPECT_NEAR(influence.color[i].r, gradient.color[i].r, 2e-4);
  }
  CloudInput pair;
  pair.center = {{-0.3, 0, 0}, {0.3, 0, 0}, {0, 0, 0}};
  pair.radius = {1, 1, 1};
  scene.cloud = std::make_shared<Cloud>(BuildCloud(pair));
  scene.surface.threshold = 1e-4;
  const Camera inside = Camera::LookAt({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 1, 9, 9);
  const Frame cancelled = MakeCpuRenderer()->Render(scene, inside, {});
  EXPECT_EQ(cancelled.stats.rays_started_inside, 81u);
  for (const Pixel& p : cancelled.color) EXPECT_TRUE(std::isfinite(p.r) && p.r > 0.0f);
}

// thesis 3.6: the mean of the surface's normal and the map's.
TEST(NormalMap, BendsTheNormalHalfway) {
  CloudInput input = Sheet(30);
  Channel map("normal_map", ChannelType::kFloat32, 3, input.center.size());
  for (std::size_t i = 0; i < input.center.size(); ++i) map.Set(i, {{0.6f, 0, 0.8f}});
  input.channels = {map};
  Scene scene = testing::SceneOf(input, 0.01);
  scene.lighting.ambient = 0;
  scene.lighting.diffuse = 1;
  scene.lighting.headlight = false;
  scene.lighting.to_light = {0, 0, 1};
  const Camera camera = DownOn(0.3, 0.3, 0.4, 40);
  const auto renderer = MakeCpuRenderer();
  RenderSettings settings = WithPlanes();
  const float base = LinearFromRgb8({200, 200, 200}).x;
  const auto check = [&](const Vec3f& mapped) {
    const Frame frame = renderer->Render(scene, camera, settings);
    for (std::size_t i = 0; i < frame.color.size(); ++i) {
      const Vec3f n = Normalized(frame.normal[i] + mapped);
      EXPECT_NEAR(frame.color[i].r, base * n.z, 1e-3);
    }
  };
  scene.appearance.normal_map.source = NormalMapSource::kChannel;
  check({0.6f, 0, 0.8f});
  // An image whose every pixel points straight out changes nothing; the mean with itself is itself.
  Image flat;
  flat.width = flat.height = 1;
  flat.encoding = ImageEncoding::kData8;
  flat.bytes = {{128, 128, 255}};
  scene.appearance.normal_map.source = NormalMapSource::kImage;
  TextureLookup& lookup = scene.appearance.normal_map.lookup;
  lookup.projection.center = {0.5, 0.5, 0};
  lookup.image = std::make_shared<ImagePyramid>(flat);
  const Frame flat_frame = renderer->Render(scene, camera, settings);
  for (std::size_t i = 0; i < flat_frame.color.size(); ++i) {
    EXPECT_NEAR(flat_frame.color[i].r, base * flat_frame.normal[i].z, 5e-3);
  }
  // Tilted to the image's right: brighter under a light from the right, darker from the left.
  flat.bytes = {{230, 128, 210}};
  lookup.image = std::make_shared<ImagePyramid>(flat);
  double mean[2] = {};
  for (const int from : {0, 1}) {
    scene.lighting.to_light = {from == 0 ? -1.0 : 1.0, 0, 1};
    const Frame frame = renderer->Render(scene, camera, settings);
    for (const Pixel& p : frame.color) mean[from] += p.r / frame.color.size();
  }
  EXPECT_GT(mean[1], 1.3 * mean[0]);
}

TEST(Deferred, RefusesWhatIsOutOfRange) {
  const Scene good = testing::SceneOf(testing::OneMetaball());
  const auto refused = [&](auto change) {
    Scene scene = good;
    change(&scene.appearance);
    EXPECT_THROW(MakeCpuRenderer()->Render(scene, testing::FrontCamera(), {}), Error);
  };
  refused([](Appearance* a) { a->filter = 4; });
  refused([](Appearance* a) { a->color = ColorSource::kTexture; });
  refused([](Appearance* a) { a->normal_map.source = NormalMapSource::kChannel; });
  refused([](Appearance* a) { a->lights = {Light{.intensity = -1}}; });
  refused(
      [](Appearance* a) { a->lights = {Light{.kind = LightKind::kDirectional, .to_light = {}}}; });
  refused([](Appearance* a) {
    a->shadows.enabled = true;
    a->shadows.bias = 0;
  });
  refused([](Appearance* a) {
    a->occlusion.enabled = true;
    a->occlusion.directions = 3;
  });
  refused([](Appearance* a) {
    a->color = ColorSource::kQuantity;
    a->pseudo.quantity = Quantity::kPosition;
    a->pseudo.axis = {};
  });
}

// The same picture whatever the number of threads, and an empty cloud gives an empty one.
TEST(Deferred, ThreadsDoNotMatterAndNothingIsNothing) {
  Scene scene = testing::SceneOf(testing::RandomBall(200, 0.4, 2, 12));
  scene.appearance.color = ColorSource::kQuantity;
  scene.appearance.shadows.enabled = true;
  scene.appearance.occlusion.enabled = true;
  scene.appearance.occlusion.directions = 8;
  scene.appearance.lights = {Light{.kind = LightKind::kPoint, .position = {3, 3, -3}}, Light{}};
  scene.appearance.filter = 3;
  RenderSettings one, all;
  one.threads = 1;
  const auto renderer = MakeCpuRenderer();
  const Camera camera = testing::FrontCamera();
  EXPECT_TRUE(
      SameColors(renderer->Render(scene, camera, one), renderer->Render(scene, camera, all)));
  scene.cloud = std::make_shared<Cloud>();
  const Frame empty = renderer->Render(scene, camera, all);
  for (const Pixel& p : empty.color) EXPECT_EQ(p.a, 0.0f);
}

}  // namespace
}  // namespace sherd
