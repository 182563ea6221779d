// Three-dimensional textures: a lattice of colours in a box of the world, looked up at the surface
// point. What moves or is cut open needs no coordinates of its own.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "metaball/color.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// A texture's lattice, on the CPU or on the GPU; members as in VolumeTexture.
struct VolumeView {
  int nx = 0, ny = 0, nz = 0;
  const Rgb8* voxels = nullptr;
  Vec3d min{}, max{1, 1, 1};
  const float* linear_from_srgb = nullptr;  // 256 values (color.h)

  // Trilinear in linear light between the voxels' centres; outside the box its border goes on.
  SHERD_HD Vec3f At(const Vec3d& point_in_world) const {
    const Between x = PlaceOf(point_in_world.x, min.x, max.x, nx);
    const Between y = PlaceOf(point_in_world.y, min.y, max.y, ny);
    const Between z = PlaceOf(point_in_world.z, min.z, max.z, nz);
    return Mix(Layer(x, y, z.lower), Layer(x, y, z.upper), z.part);
  }

 private:
  struct Between {
    int lower, upper;
    float part;  // towards the upper
  };

  static SHERD_HD Between PlaceOf(double p, double lo, double hi, int n) {
    const double x = std::clamp((p - lo) / (hi - lo) * n - 0.5, 0.0, static_cast<double>(n) - 1);
    const int lower = std::min(static_cast<int>(x), n - 1);
    return {lower, std::min(lower + 1, n - 1), static_cast<float>(x - lower)};
  }
  static SHERD_HD Vec3f Mix(const Vec3f& a, const Vec3f& b, float t) {
    return a * (1.0f - t) + b * t;
  }
  SHERD_HD Vec3f Voxel(int i, int j, int k) const {
    return LinearFromRgb8(voxels[(static_cast<std::size_t>(k) * ny + j) * nx + i],
                          linear_from_srgb);
  }
  SHERD_HD Vec3f Row(const Between& x, int j, int k) const {
    return Mix(Voxel(x.lower, j, k), Voxel(x.upper, j, k), x.part);
  }
  SHERD_HD Vec3f Layer(const Between& x, const Between& y, int k) const {
    return Mix(Row(x, y.lower, k), Row(x, y.upper, k), y.part);
  }
};

struct VolumeTexture {
  int nx = 0, ny = 0, nz = 0;  // voxels, all >= 1
  std::vector<Rgb8> voxels;    // sRGB, x fastest, then y, then z
  Vec3d min{}, max{1, 1, 1};   // the box, world; min < max on every axis

  // Throws Error where the lattice or the box is not as said above.
  void Validate() const;
  // Valid while the texture lives unchanged.
  VolumeView view() const;
  // As VolumeView::At.
  Vec3f At(const Vec3d& point_in_world) const { return view().At(point_in_world); }
};

}  // namespace sherd
