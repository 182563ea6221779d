#include "metaball/photo/pyramid.h"

#include "metaball/photo/filter.h"

namespace sherd {

Vec3f PhotoPyramid::Sample(float x, float y, float level) const {
  return SampleTexels(*this, x, y, level);
}

Vec3f PhotoPyramid::SampleSharply(float x, float y, int level) const {
  return SampleTexelsSharply(*this, x, y, level);
}

std::size_t PhotoPyramid::MemoryBytes() const {
  std::size_t bytes = 0;
  for (const PhotoLevel& level : levels_) bytes += level.pixels.capacity() * sizeof(Rgb8);
  return bytes;
}

std::size_t PhotoPyramid::BytesFor(int width, int height, int finest) {
  std::size_t bytes = 0;
  for (int w = width, h = height, level = 0; w > 1 || h > 1; ++level) {
    if (level >= finest) bytes += static_cast<std::size_t>(w) * h * sizeof(Rgb8);
    w = HalvedSide(w);
    h = HalvedSide(h);
  }
  return bytes + sizeof(Rgb8);
}

}  // namespace sherd
