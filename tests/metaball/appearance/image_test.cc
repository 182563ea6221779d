#include "metaball/appearance/image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "metaball/appearance/projection.h"
#include "metaball/appearance/volume_texture.h"
#include "metaball/error.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

Image FloatImage(int width, int height, auto value) {
  Image image;
  image.width = width;
  image.height = height;
  image.encoding = ImageEncoding::kFloat;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.floats.push_back(value(x, y));
  }
  return image;
}

TEST(ImagePyramid, EveryLevelKeepsTheMean) {
  const Image image = FloatImage(37, 22, [](int x, int y) {
    return Vec3f{static_cast<float>(x * y % 7), static_cast<float>(x), static_cast<float>(y & 1)};
  });
  Vec3d mean{};
  for (const Vec3f& v : image.floats) mean += v.cast<double>() / 814.0;
  const ImagePyramid pyramid(image);
  EXPECT_EQ(pyramid.levels(), 6);
  for (int k = 0; k < pyramid.levels(); ++k) {
    const Image& level = pyramid.level(k);
    Vec3d sum{};
    for (const Vec3f& v : level.floats) sum += v.cast<double>();
    EXPECT_LT(Length(sum / static_cast<double>(level.pixels()) - mean), 1e-4) << k;
  }
  EXPECT_EQ(pyramid.level(5).pixels(), 1u);
}

// Half black, half white pixels are half the light, which is sRGB 188 and not 128.
TEST(ImagePyramid, FiltersInLinearLight) {
  Image image;
  image.width = image.height = 2;
  image.bytes = {{0, 0, 0}, {255, 255, 255}, {255, 255, 255}, {0, 0, 0}};
  EXPECT_EQ(ImagePyramid(image).level(1).bytes[0], (Rgb8{188, 188, 188}));
  image.encoding = ImageEncoding::kData8;
  EXPECT_EQ(ImagePyramid(image).level(1).bytes[0], (Rgb8{128, 128, 128}));
}

TEST(ImagePyramid, OrientationAndBorders) {
  const ImagePyramid pyramid(FloatImage(4, 2, [](int x, int y) {
    return Vec3f{static_cast<float>(x), static_cast<float>(y), 0};
  }));
  // u = 1/8 is the middle of the first column; v = 3/4 the middle of the upper row.
  EXPECT_EQ(pyramid.Sample(0.125f, 0.75f, {}, false, false), (Vec3f{0, 0, 0}));
  EXPECT_EQ(pyramid.Sample(0.875f, 0.25f, {}, false, false), (Vec3f{3, 1, 0}));
  EXPECT_NEAR(pyramid.Sample(0.25f, 0.75f, {}, false, false).x, 0.5f, 1e-6);
  EXPECT_EQ(pyramid.Sample(-9.0f, 0.75f, {}, false, false).x, 0.0f);
  EXPECT_NEAR(pyramid.Sample(1.0f, 0.75f, {}, true, false).x, 1.5f, 1e-6);
  EXPECT_NEAR(pyramid.Sample(0.0f, 0.75f, {}, true, false).x, 1.5f, 1e-6);
  EXPECT_EQ(pyramid.Sample(NAN, INFINITY, {}, false, false).x, 0.0f);
}

// A footprint as large as the image sees its mean; one that is long in u alone does not blur v.
TEST(ImagePyramid, FootprintsChooseTheLevel) {
  const ImagePyramid stripes(FloatImage(256, 256, [](int x, int y) {
    return Vec3f{static_cast<float>(x & 1), static_cast<float>(y / 64 & 1), 0};
  }));
  const Vec3f all = stripes.Sample(0.5f, 0.5f, {1, 0, 0, 1}, true, true);
  EXPECT_NEAR(all.x, 0.5f, 1e-3);
  EXPECT_NEAR(all.y, 0.5f, 1e-3);
  // Eight pixels long, one high, in the middle of the second band from below.
  const Vec3f wide = stripes.Sample(0.5f, 0.375f, {8.0f / 256, 0, 0, 1.0f / 256}, true, true);
  EXPECT_NEAR(wide.x, 0.5f, 0.03f);
  EXPECT_NEAR(wide.y, 0.0f, 1e-6f);
  const Vec3f other = stripes.Sample(0.5f, 0.625f, {8.0f / 256, 0, 0, 1.0f / 256}, true, true);
  EXPECT_NEAR(other.y, 1.0f, 1e-6f);
}

TEST(ImagePyramid, ViewsOutliveAMove) {
  ImagePyramid from(FloatImage(4, 2, [](int x, int y) {
    return Vec3f{static_cast<float>(x), static_cast<float>(y), 0};
  }));
  const ImageView view = from.view();
  const Vec3f before = view.Sample(0.3f, 0.7f, {}, false, false);
  const ImagePyramid to = std::move(from);
  EXPECT_EQ(view.Sample(0.3f, 0.7f, {}, false, false), before);
  EXPECT_EQ(to.Sample(0.3f, 0.7f, {}, false, false), before);
  EXPECT_EQ(to.view().level, view.level);
}

TEST(ImagePyramid, RefusesAWrongSize) {
  Image image = FloatImage(3, 3, [](int, int) { return Vec3f{}; });
  image.width = 4;
  EXPECT_THROW(ImagePyramid{image}, Error);
}

Cloud BoxCloud() {
  CloudInput input;
  input.uniform_radius = 0.1;
  for (const double x : {-2.0, 2.0}) {
    for (const double y : {-1.0, 3.0}) {
      for (const double z : {0.0, 1.0}) input.center.push_back({x, y, z});
    }
  }
  return BuildCloud(input);
}

TEST(Projection, PlanarFitsTheCloud) {
  const TextureProjection p =
      FitProjection(BoxCloud(), ProjectionKind::kPlanar, {0, 0, -1}, {0, 1, 0});
  double u = 0, v = 0;
  p.At({-2, -1, 0.3}, &u, &v);
  EXPECT_NEAR(u, 0, 1e-6);
  EXPECT_NEAR(v, 0, 1e-6);
  p.At({2, 3, 7}, &u, &v);
  EXPECT_NEAR(u, 1, 1e-6);
  EXPECT_NEAR(v, 1, 1e-6);
  EXPECT_THROW(FitProjection(BoxCloud(), ProjectionKind::kPlanar, {0, 0, 1}, {0, 0, 2}), Error);
}

TEST(Projection, RoundOnesGoAroundOnce) {
  for (const ProjectionKind kind : {ProjectionKind::kCylindrical, ProjectionKind::kSpherical}) {
    TextureProjection p;
    p.kind = kind;
    p.right = {1, 0, 0};
    p.up = {0, 0, 1};
    p.forward = {0, 1, 0};
    double u = 0, v = 0;
    for (int k = -17; k <= 17; ++k) {
      const double angle = std::numbers::pi * k / 18;
      p.At(Vec3d{3 * std::sin(angle), -3 * std::cos(angle), 0}, &u, &v);
      EXPECT_NEAR(u, 0.5 + k / 36.0, 1e-12);
      EXPECT_NEAR(v, 0.5, 1e-12);
    }
    p.At({0, 0, 0.5}, &u, &v);  // on the axis
    EXPECT_EQ(u, 0.5);
    EXPECT_NEAR(v, 1.0, 1e-12);
    p.At({0, 0, 0}, &u, &v);
    EXPECT_EQ(v, 0.5);
  }
}

// Each side of the cube shows the whole image, not mirrored: seen from outside, u grows to the
// right and v upwards.
TEST(Projection, CubeSidesAreNotMirrored) {
  TextureProjection p;
  p.kind = ProjectionKind::kCubic;
  p.right = {1, 0, 0};
  p.up = {0, 1, 0};
  p.forward = {0, 0, -1};
  const Vec3d sides[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (const Vec3d& side : sides) {
    const Vec3d middle = side * 0.5;
    double u = 0, v = 0;
    p.At(middle, &u, &v);
    EXPECT_NEAR(u, 0.5, 1e-12);
    EXPECT_NEAR(v, 0.5, 1e-12);
    Vec3d along_u{}, along_v{};
    for (const Vec3d& axis : {Vec3d{0.1, 0, 0}, Vec3d{0, 0.1, 0}, Vec3d{0, 0, 0.1}}) {
      double u1 = 0, v1 = 0;
      p.At(middle + axis, &u1, &v1);
      along_u += axis * (u1 - u);
      along_v += axis * (v1 - v);
    }
    EXPECT_GT(Dot(Cross(along_u, along_v), side), 0) << side.x << side.y << side.z;
  }
}

TEST(VolumeTexture, IsTrilinear) {
  VolumeTexture volume;
  volume.nx = 3;
  volume.ny = 2;
  volume.nz = 4;
  volume.min = {-1, 0, 5};
  volume.max = {2, 4, 9};
  for (int i = 0; i < 24; ++i) {
    const auto byte = [&](int k) { return static_cast<std::uint8_t>(i * k % 251); };
    volume.voxels.push_back({byte(7), byte(31), byte(101)});
  }
  volume.Validate();
  const auto voxel = [&](int x, int y, int z) {
    return LinearFromRgb8(volume.voxels[static_cast<std::size_t>((z * 2 + y) * 3 + x)]);
  };
  EXPECT_EQ(volume.At({-0.5, 1, 5.5}), voxel(0, 0, 0));
  EXPECT_EQ(volume.At({1.5, 3, 8.5}), voxel(2, 1, 3));
  EXPECT_EQ(volume.At({-100, -100, 100}), voxel(0, 0, 3));
  Vec3f mean{};
  for (int k = 0; k < 8; ++k) mean += voxel(k & 1, k >> 1 & 1, k >> 2) * 0.125f;
  EXPECT_LT(Length(volume.At({0, 2, 6}) - mean), 1e-6f);
  volume.nz = 5;
  EXPECT_THROW(volume.Validate(), Error);
}

}  // namespace
}  // namespace sherd
