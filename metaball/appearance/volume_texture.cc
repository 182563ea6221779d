#include "metaball/appearance/volume_texture.h"

#include <cstddef>

#include "metaball/error.h"

namespace sherd {

void VolumeTexture::Validate() const {
  if (nx < 1 || ny < 1 || nz < 1 || voxels.size() != static_cast<std::size_t>(nx) * ny * nz) {
    throw Error("a three-dimensional texture needs as many voxels as its sides say");
  }
  const Vec3d size = max - min;
  if (!(size.x > 0) || !(size.y > 0) || !(size.z > 0) || !IsFinite(size)) {
    throw Error("a three-dimensional texture needs a box with a positive, finite size");
  }
}

VolumeView VolumeTexture::view() const {
  return {nx, ny, nz, voxels.data(), min, max, SrgbToLinearTable()};
}

}  // namespace sherd
