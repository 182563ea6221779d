#include "metaball/appearance/volume_texture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "metaball/error.h"

namespace sherd {
namespace {

struct Between {
  int lower = 0, upper = 0;
  float part = 0.0f;  // towards the upper
};

Between PlaceOf(double p, double lo, double hi, int n) {
  const double x = std::clamp((p - lo) / (hi - lo) * n - 0.5, 0.0, static_cast<double>(n) - 1);
  Between place;
  place.lower = std::min(static_cast<int>(x), n - 1);
  place.upper = std::min(place.lower + 1, n - 1);
  place.part = static_cast<float>(x - place.lower);
  return place;
}

Vec3f Mix(const Vec3f& a, const Vec3f& b, float t) { return a * (1.0f - t) + b * t; }

}  // namespace

void VolumeTexture::Validate() const {
  if (nx < 1 || ny < 1 || nz < 1 || voxels.size() != static_cast<std::size_t>(nx) * ny * nz) {
    throw Error("a three-dimensional texture needs as many voxels as its sides say");
  }
  const Vec3d size = max - min;
  if (!(size.x > 0) || !(size.y > 0) || !(size.z > 0) || !IsFinite(size)) {
    throw Error("a three-dimensional texture needs a box with a positive, finite size");
  }
}

Vec3f VolumeTexture::At(const Vec3d& p) const {
  const Between x = PlaceOf(p.x, min.x, max.x, nx);
  const Between y = PlaceOf(p.y, min.y, max.y, ny);
  const Between z = PlaceOf(p.z, min.z, max.z, nz);
  const auto voxel = [&](int i, int j, int k) {
    return LinearFromRgb8(voxels[(static_cast<std::size_t>(k) * ny + j) * nx + i]);
  };
  const auto row = [&](int j, int k) {
    return Mix(voxel(x.lower, j, k), voxel(x.upper, j, k), x.part);
  };
  const auto layer = [&](int k) { return Mix(row(y.lower, k), row(y.upper, k), y.part); };
  return Mix(layer(z.lower), layer(z.upper), z.part);
}

}  // namespace sherd
