// The CPU renderer, both paths, against the double-precision reference.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/cpu_renderer.h"
#include "metaball/error.h"
#include "metaball/frame_difference.h"
#include "test_scenes.h"

namespace sherd {
namespace {

class CpuPathTest : public ::testing::TestWithParam<CpuPath> {
 protected:
  Frame Render(const Scene& scene, const Camera& camera, int supersample = 1, int threads = 0) {
    RenderSettings settings;
    settings.planes = {true, true, true};
    settings.supersample = supersample;
    settings.threads = threads;
    return renderer_->Render(scene, camera, settings);
  }

  // The design's contract, pixel by pixel.
  void ExpectAgreesWithReference(const Scene& scene, const Camera& camera) {
    const Frame frame = Render(scene, camera);
    const FrameDifference d =
        CompareToReference(frame, ReferenceRender(scene, camera), scene.cloud->frame.unit);
    EXPECT_EQ(d.missed, 0u) << d.Describe();
    EXPECT_EQ(d.invented, 0u) << d.Describe();
    EXPECT_EQ(d.color_off, 0u) << d.Describe();
    EXPECT_LE(d.depth_max, 1e-4) << d.Describe();
    EXPECT_EQ(frame.stats.unresolved, 0u);
  }

  std::unique_ptr<Renderer> renderer_ = MakeCpuRenderer(GetParam());
};

TEST_P(CpuPathTest, HeightFieldAndShell) {
  for (const std::uint64_t n : {1000, 20000}) {
    const PeerScene field = MakeHeightField(n, 320, 180), shell = MakeShell(n, 320, 180);
    ExpectAgreesWithReference(field.scene, field.camera);
    ExpectAgreesWithReference(shell.scene, shell.camera);
  }
}

TEST_P(CpuPathTest, OneMetaballIsASphere) {
  const Scene scene = testing::SceneOf(testing::OneMetaball());
  const Camera camera = testing::FrontCamera(201, 151);
  ExpectAgreesWithReference(scene, camera);
  // (1 - x^2)^2 = T on the sphere of radius sqrt(1 - sqrt(T)).
  const double radius = std::sqrt(1 - std::sqrt(0.7));
  const Frame frame = Render(scene, camera);
  for (int y = 0; y < 151; ++y) {
    for (int x = 0; x < 201; ++x) {
      const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
      const double b = -Dot(ray.origin, ray.direction);
      const double root2 = radius * radius - (Dot(ray.origin, ray.origin) - b * b);
      const std::size_t i = static_cast<std::size_t>(y) * 201 + x;
      if (root2 > 1e-6) {
        ASSERT_GT(frame.depth[i], 0) << x << ", " << y;
        ASSERT_NEAR(frame.depth[i], b - std::sqrt(root2), 1e-5);
        const Vec3d p = ray.origin + ray.direction * (b - std::sqrt(root2));
        ASSERT_NEAR(Length(frame.normal[i].cast<double>() - p / radius), 0, 1e-3);
        ASSERT_EQ(frame.id[i], 0);
      } else if (root2 < -1e-6) {
        ASSERT_EQ(frame.depth[i], 0);
        ASSERT_EQ(frame.id[i], -1);
        ASSERT_EQ(frame.color[i].a, 0);
      }
    }
  }
}

TEST_P(CpuPathTest, TwoMetaballsMerge) {
  CloudInput input;
  input.center = {{-0.5, 0, 0}, {0.5, 0, 0}};
  input.radius = {1.0, 0.8};
  input.color = {{255, 0, 0}, {0, 0, 255}};
  ExpectAgreesWithReference(testing::SceneOf(input, 0.3), testing::FrontCamera());
}

TEST_P(CpuPathTest, RandomCloudsOfManyRadii) {
  for (const double spread : {1.0, 10.0, 1000.0}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const Scene scene = testing::SceneOf(testing::RandomBall(3000, 0.2, spread, seed));
      ExpectAgreesWithReference(scene, testing::FrontCamera(160, 120));
      ExpectAgreesWithReference(
          scene, Camera::LookAtOrthographic({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 2.5, 120, 120));
    }
  }
}

TEST_P(CpuPathTest, ThresholdAndRadiusScaleTakeEffect) {
  Scene scene = testing::SceneOf(testing::RandomBall(2000, 0.15, 4, 5));
  for (const double threshold : {1e-3, 0.1, 2.5}) {
    for (const double scale : {0.5, 1.7}) {
      scene.surface = {threshold, scale};
      ExpectAgreesWithReference(scene, testing::FrontCamera(96, 72));
    }
  }
}

TEST_P(CpuPathTest, LightingFollowsTheThesis) {
  Scene scene = testing::SceneOf(testing::RandomBall(2000, 0.15, 4, 6));
  const Camera camera = testing::FrontCamera(96, 72);
  scene.lighting = {.unlit = true};
  ExpectAgreesWithReference(scene, camera);
  scene.lighting = {.ambient = 0.1, .diffuse = 2.5, .headlight = false, .to_light = {3, 9, -5}};
  ExpectAgreesWithReference(scene, camera);
  for (const Pixel& p : Render(scene, camera).color) ASSERT_LE(p.r, 1.0f);  // min(1, ...)
}

TEST_P(CpuPathTest, ThreadsAndRepetitionGiveTheSamePicture) {
  const Scene scene = testing::SceneOf(testing::RandomBall(2000, 0.15, 4, 12));
  const Frame a = Render(scene, testing::FrontCamera(), 1, 1);
  const Frame b = Render(scene, testing::FrontCamera(), 1, 2);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.id, b.id);
}

TEST_P(CpuPathTest, SupersamplingAveragesInLinearLight) {
  const Scene scene = testing::SceneOf(testing::RandomBall(500, 0.3, 2, 14));
  const Camera camera = testing::FrontCamera(40, 30);
  const Frame fine = Render(scene, camera.Resized(120, 90));
  const Frame averaged = Render(scene, camera, 3);
  ASSERT_EQ(averaged.width, 40);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      float sum = 0, alpha = 0;
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
          const Pixel& p = fine.color[static_cast<std::size_t>(3 * y + j) * 120 + 3 * x + i];
          sum += p.g;
          alpha += p.a;
        }
      }
      const Pixel& p = averaged.color[static_cast<std::size_t>(y) * 40 + x];
      ASSERT_NEAR(p.g, sum / 9, 1e-6);
      ASSERT_NEAR(p.a, alpha / 9, 1e-6);
    }
  }
}

TEST_P(CpuPathTest, ARecycledFrameLeavesNothingInTheNext) {
  const PeerScene field = MakeHeightField(2000, 90, 60);
  Camera away = field.camera;  // sees nothing
  away.forward = -field.camera.forward;
  away.right = -field.camera.right;
  Frame frame = Render(field.scene, field.camera);
  const Pixel* const memory = frame.color.data();
  EXPECT_GT(frame.stats.hits, 1000u);
  renderer_->Recycle(std::move(frame));
  frame = Render(field.scene, away);
  EXPECT_EQ(frame.color.data(), memory);
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    ASSERT_TRUE(frame.color[i].a == 0 && frame.color[i].r == 0 && frame.depth[i] == 0);
    ASSERT_TRUE(frame.normal[i] == Vec3f{} && frame.id[i] == -1);
  }
}

TEST_P(CpuPathTest, StopsWhenAsked) {
  const Scene scene = testing::SceneOf(testing::RandomBall(2000, 0.15, 4, 15));
  std::stop_source stop;
  stop.request_stop();
  Control control;
  control.stop = stop.get_token();
  EXPECT_THROW(renderer_->Render(scene, testing::FrontCamera(), {}, control), Cancelled);
  // And works again afterwards.
  EXPECT_GT(Render(scene, testing::FrontCamera()).stats.hits, 0u);
}

TEST_P(CpuPathTest, PlanesAreThereOnlyWhenAskedFor) {
  const Scene scene = testing::SceneOf(testing::OneMetaball());
  const Frame frame = renderer_->Render(scene, testing::FrontCamera(), {});
  EXPECT_TRUE(frame.depth.empty());
  EXPECT_TRUE(frame.normal.empty());
  EXPECT_TRUE(frame.id.empty());
  EXPECT_EQ(frame.stats.backend, "cpu");
  EXPECT_EQ(frame.stats.rays, 96u * 64);
}

INSTANTIATE_TEST_SUITE_P(Paths, CpuPathTest, ::testing::Values(CpuPath::kScalar, CpuPath::kBest),
                         [](const auto& param_info) {
                           return param_info.param == CpuPath::kScalar ? "Scalar" : "Best";
                         });

// The blocks and cones of the reference's picture must not lose a metaball.
TEST(Reference, PictureEqualsRaysAgainstEveryMetaball) {
  const Scene scene = testing::SceneOf(testing::RandomBall(400, 0.2, 20, 21));
  const Camera camera = testing::FrontCamera(40, 30);
  const ReferenceFrame frame = ReferenceRender(scene, camera);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
      ray.origin = scene.cloud->frame.LocalFromWorld(ray.origin);
      const ReferenceHit hit = ReferenceTrace(scene, ray);
      const ReferenceHit& pixel = frame.pixels[static_cast<std::size_t>(y) * 40 + x];
      ASSERT_EQ(hit.hit, pixel.hit);
      ASSERT_NEAR(hit.depth, pixel.depth, 1e-12);
      if (hit.hit) {
        ASSERT_NEAR(ReferenceField(scene, ray.origin + ray.direction * hit.depth), 0.7, 1e-9);
        // No crossing before it: the field sampled finely stays below the threshold.
        for (int k = 0; k < 400; ++k) {
          ASSERT_LT(ReferenceField(scene, ray.origin + ray.direction * (hit.depth * k / 400)),
                    0.7 * (1 + 1e-9));
        }
      }
    }
  }
}

TEST(CheckRenderInput, RefusesWhatCannotBeDrawn) {
  auto renderer = MakeCpuRenderer();
  const Scene good = testing::SceneOf(testing::OneMetaball());
  const Camera camera = testing::FrontCamera();
  EXPECT_THROW(renderer->Render(Scene{}, camera, {}), Error);
  for (const double bad : {0.0, -1.0, static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
    Scene scene = good;
    scene.surface.threshold = bad;
    EXPECT_THROW(renderer->Render(scene, camera, {}), Error);
    scene = good;
    scene.surface.radius_scale = bad;
    EXPECT_THROW(renderer->Render(scene, camera, {}), Error);
    Camera c = camera;
    c.fx = bad;
    EXPECT_THROW(renderer->Render(good, c, {}), Error);
  }
  Camera empty = camera;
  empty.width = 0;
  EXPECT_THROW(renderer->Render(good, empty, {}), Error);
  RenderSettings settings;
  settings.supersample = 9;
  EXPECT_THROW(renderer->Render(good, camera, settings), Error);
}

}  // namespace
}  // namespace sherd
