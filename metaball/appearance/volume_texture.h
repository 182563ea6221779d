// Three-dimensional textures: a lattice of colours in a box of the world, looked up at the surface
// point. What moves or is cut open needs no coordinates of its own.
#pragma once

#include <vector>

#include "metaball/color.h"
#include "metaball/vec.h"

namespace sherd {

struct VolumeTexture {
  int nx = 0, ny = 0, nz = 0;  // voxels, all >= 1
  std::vector<Rgb8> voxels;    // sRGB, x fastest, then y, then z
  Vec3d min{}, max{1, 1, 1};   // the box, world; min < max on every axis

  // Throws Error where the lattice or the box is not as said above.
  void Validate() const;
  // Trilinear in linear light between the voxels' centres; outside the box its border goes on.
  Vec3f At(const Vec3d& point_in_world) const;
};

}  // namespace sherd
