#include "metaball/tile_bounds.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "metaball/local_view.h"

namespace sherd {
namespace {

// Every pixel whose ray meets the sphere must lie inside the bounds; far-away pixels should not.
TEST(TileBounds, HoldEveryPixelThatSeesTheSphere) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::uint64_t seen = 0, bounded = 0;
  for (int round = 0; round < 400; ++round) {
    Camera camera =
        round % 2 ? Camera::LookAt({0, 0, 0}, {uniform(random), uniform(random), 1}, {0, 1, 0},
                                   (20 + 140 * (round % 7) / 7.0) * std::numbers::pi / 180, 48, 36)
                  : Camera::LookAtOrthographic({0, 0, 0}, {uniform(random), uniform(random), 1},
                                               {0, 1, 0}, 4, 48, 36);
    camera.cx += 10 * uniform(random);
    // Spheres in front, around the eye's plane, around the eye, behind.
    const Vec3d center{2 * uniform(random), 2 * uniform(random), 1.5 + 2 * uniform(random)};
    const double radius = 0.02 + 0.8 * std::pow(uniform(random), 2);
    float front = 0;
    const PixelBox box =
        BoundsOfSphere(ViewOf(camera), center.cast<float>(), static_cast<float>(radius), &front);
    for (int y = 0; y < 36; ++y) {
      for (int x = 0; x < 48; ++x) {
        const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
        const double b = Dot(center - ray.origin, ray.direction);
        const double across2 = Dot(center - ray.origin, center - ray.origin) - b * b;
        const bool meets =
            across2 < radius * radius && b + std::sqrt(radius * radius - across2) > 0;
        const bool inside = x >= box.x0 && x < box.x1 && y >= box.y0 && y < box.y1;
        if (meets) {
          ++seen;
          ASSERT_TRUE(inside) << "round " << round << " pixel " << x << ", " << y;
          ASSERT_LE(front, b - std::sqrt(radius * radius - across2) + 1e-12);
        }
        bounded += inside;
      }
    }
  }
  EXPECT_GT(seen, 10000u);
  // Discs in boxes: a box holds at least pi / 4 of its disc; edges and corners cost the rest.
  EXPECT_LT(static_cast<double>(bounded), 1.9 * static_cast<double>(seen));
}

TEST(TileBounds, SpheresBehindTheEyeAreNotSeen) {
  const Camera camera = Camera::LookAt({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 1.0, 64, 64);
  float front;
  EXPECT_TRUE(BoundsOfSphere(ViewOf(camera), {0, 0, -2}, 1.0f, &front).empty());
  // Beside the eye, reaching its plane, but far outside the picture.
  EXPECT_TRUE(BoundsOfSphere(ViewOf(camera), {50, 0, 0.5f}, 1.0f, &front).empty());
  // Around the eye: everything sees it.
  const PixelBox all = BoundsOfSphere(ViewOf(camera), {0, 0, 0.1f}, 1.0f, &front);
  EXPECT_EQ(all.x1 - all.x0, 64);
  EXPECT_EQ(all.y1 - all.y0, 64);
}

}  // namespace
}  // namespace sherd
