// What the picture must not depend on, for every density and threshold mode, both CPU paths: the
// order of the metaballs, where the scene stands, how large it is, where tiles and packets begin,
// how large a tile is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "metaball/cpu_renderer.h"
#include "metaball/density/shapes.h"
#include "metaball/local_view.h"
#include "metaball/tile_march.h"
#include "test_scenes.h"

namespace sherd {
namespace {

constexpr int kWidth = 48, kHeight = 32;
constexpr double kRadius = 0.3, kSpread = 3.0;  // radii from 0.1 to 0.3
// Two pictures each within the contract's 1e-4 radii of the truth.
constexpr double kDepthTolerance = 2e-4 * kRadius / kSpread;

class InvarianceTest : public ::testing::TestWithParam<testing::PathAndMode> {
 protected:
  // Calls f with every density in turn; draw with Render.
  template <class F>
  void ForEveryDensity(const F& f) {
    testing::ForEveryDensity(GetParam().mode, [&](const DensityModel& density) {
      SCOPED_TRACE(TextOf(density));
      threshold_ = testing::ThresholdFor(density, GetParam().mode);
      density_ = density;
      f(testing::BallWithThresholds(300, kRadius, kSpread, 8, threshold_));
    });
  }
  Scene SceneOf(const CloudInput& input) const {
    Scene scene = testing::SceneOf(input, threshold_);
    scene.surface.density = density_;
    scene.surface.mode = GetParam().mode;
    return scene;
  }
  Frame Render(const CloudInput& input, const Camera& camera) {
    RenderSettings settings;
    settings.planes.depth = settings.planes.normal = settings.planes.id = true;
    Frame frame = renderer_->Render(SceneOf(input), camera, settings);
    EXPECT_GT(frame.stats.hits, frame.stats.rays / 100);
    return frame;
  }
  static Camera View() {
    Camera camera = testing::FrontCamera(kWidth, kHeight);
    camera.eye = {0.25, 0.5, -4};  // stays exact when it is moved far away
    return camera;
  }
  // Rounding decides on pixels at silhouettes; and with summed thresholds, which jump at the rims
  // of the supports, on which side of a rim a point lies.
  static void ExpectFewDiffer(int differ) {
    EXPECT_LE(differ, GetParam().mode == ThresholdMode::kSummed ? kWidth * kHeight / 100 : 2);
  }
  static bool Differ(double a, double b) {
    return (a > 0) != (b > 0) || std::abs(a - b) > kDepthTolerance;
  }

  DensityModel density_;
  double threshold_ = 0.7;
  std::unique_ptr<Renderer> renderer_ = MakeCpuRenderer(GetParam().path);
};

TEST_P(InvarianceTest, OrderOfTheMetaballs) {
  ForEveryDensity([&](const CloudInput& input) {
    CloudInput reversed = input;
    std::reverse(reversed.center.begin(), reversed.center.end());
    std::reverse(reversed.radius.begin(), reversed.radius.end());
    std::reverse(reversed.color.begin(), reversed.color.end());
    std::reverse(reversed.threshold.begin(), reversed.threshold.end());
    const Frame a = Render(input, View()), b = Render(reversed, View());
    EXPECT_EQ(a.depth, b.depth);
    EXPECT_EQ(a.id, b.id);
  });
}

TEST_P(InvarianceTest, TranslationBy1e7) {
  ForEveryDensity([&](CloudInput near) {
    // On a grid that survives the shift exactly: what remains to differ is the program.
    for (Vec3d& p : near.center) {
      p = {std::ldexp(std::round(std::ldexp(p.x, 24)), -24),
           std::ldexp(std::round(std::ldexp(p.y, 24)), -24),
           std::ldexp(std::round(std::ldexp(p.z, 24)), -24)};
    }
    const Vec3d shift{1e7, -1e7, 3e6};
    CloudInput far = near;
    for (Vec3d& p : far.center) p += shift;
    Camera far_camera = View();
    far_camera.eye += shift;
    const Frame a = Render(near, View()), b = Render(far, far_camera);
    EXPECT_EQ(a.depth, b.depth);
    EXPECT_EQ(a.id, b.id);
  });
}

TEST_P(InvarianceTest, Scale) {
  ForEveryDensity([&](const CloudInput& one) {
    const Frame expected = Render(one, View());
    for (const double scale : {0x1p-20, 0x1p20, 1e-6, 1e6}) {
      CloudInput scaled = one;
      for (Vec3d& p : scaled.center) p = p * scale;
      for (double& r : scaled.radius) r *= scale;
      Camera camera = View();
      camera.eye = camera.eye * scale;
      const Frame frame = Render(scaled, camera);
      int differ = 0;
      for (std::size_t i = 0; i < frame.depth.size(); ++i) {
        const double depth = frame.depth[i] / scale;
        // Powers of two change nothing at all.
        const bool exact = std::abs(std::log2(scale)) == 20;
        differ += exact ? depth != expected.depth[i] : Differ(depth, expected.depth[i]);
      }
      if (std::abs(std::log2(scale)) == 20) {
        EXPECT_EQ(differ, 0) << scale;
      } else {
        ExpectFewDiffer(differ);
      }
    }
  });
}

// A part of a picture has tiles and packets that begin at other pixels.
TEST_P(InvarianceTest, WhereTilesBegin) {
  ForEveryDensity([&](const CloudInput& input) {
    const Frame whole = Render(input, View());
    constexpr int kX = 13, kY = 5, kPartWidth = 30, kPartHeight = 25;
    const Frame part = Render(input, View().Cropped(kX, kY, kPartWidth, kPartHeight));
    int differ = 0;
    for (int y = 0; y < kPartHeight; ++y) {
      for (int x = 0; x < kPartWidth; ++x) {
        const std::size_t in_part = static_cast<std::size_t>(y) * kPartWidth + x;
        const std::size_t in_whole = static_cast<std::size_t>(y + kY) * kWidth + x + kX;
        differ += Differ(part.depth[in_part], whole.depth[in_whole]);
      }
    }
    ExpectFewDiffer(differ);
  });
}

// The whole picture as one tile: a list of every metaball, nearest first.
TEST_P(InvarianceTest, SizeOfATile) {
  ForEveryDensity([&](const CloudInput& input) {
    const Scene scene = SceneOf(input);
    const Cloud& cloud = *scene.cloud;
    const ResolvedDensity density = ResolveDensity(scene.surface.density);
    const Camera local = LocalCamera(View(), cloud.frame);
    std::vector<TileEntry> entries;
    for (std::uint32_t i = 0; i < cloud.size(); ++i) {
      const double distance = Length(cloud.center[i].cast<double>() - local.eye);
      const double support = cloud.radius[i] * density.support;
      entries.push_back({i, static_cast<float>(distance - support - 1e-6 * distance)});
    }
    std::sort(entries.begin(), entries.end(),
              [](const TileEntry& x, const TileEntry& y) { return x.front < y.front; });
    TileList list;
    list.entry = entries.data();
    list.count = static_cast<int>(entries.size());
    list.center = cloud.center.data();
    list.radius = cloud.radius.data();
    list.radius_scale = density.support;
    list.threshold = GetParam().mode == ThresholdMode::kUniform ? nullptr : cloud.threshold.data();
    list.uniform_threshold = scene.surface.threshold;
    list.threshold_scale = 1 / density.amplitude;
    const AnyShape shape{density.shape};
    const auto march = [&](const RayD& ray, RayCounts* counts) {
      switch (GetParam().mode) {
        case ThresholdMode::kBlended:
          return MarchTile<ThresholdMode::kBlended, float>(list, shape, ray, counts);
        case ThresholdMode::kSummed:
          return MarchTile<ThresholdMode::kSummed, float>(list, shape, ray, counts);
        case ThresholdMode::kGated:
          return MarchTile<ThresholdMode::kGated, float>(list, shape, ray, counts);
        case ThresholdMode::kUniform:
          break;
      }
      return MarchTile<ThresholdMode::kUniform, float>(list, shape, ray, counts);
    };
    const Frame frame = Render(input, View());
    RayCounts counts;
    int differ = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const TileHit hit = march(RayThrough(local, x + 0.5, y + 0.5), &counts);
        const double depth = hit.hit ? hit.depth * cloud.frame.unit : 0.0;
        differ += Differ(depth, frame.depth[static_cast<std::size_t>(y) * kWidth + x]);
      }
    }
    EXPECT_EQ(counts.unresolved, 0u);
    ExpectFewDiffer(differ);
  });
}

INSTANTIATE_TEST_SUITE_P(All, InvarianceTest, testing::EveryPathAndMode(),
                         testing::NameOfPathAndMode);

}  // namespace
}  // namespace sherd
