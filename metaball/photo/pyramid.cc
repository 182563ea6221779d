#include "metaball/photo/pyramid.h"

#include <algorithm>

#include "metaball/photo/filter.h"

namespace sherd {

std::vector<LevelSize> LevelSizes(int width, int height) {
  std::vector<LevelSize> sizes{{width, height}};
  while (sizes.back().width > 1 || sizes.back().height > 1) {
    sizes.push_back({HalvedSide(sizes.back().width), HalvedSide(sizes.back().height)});
  }
  return sizes;
}

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
  const std::vector<LevelSize> sizes = LevelSizes(width, height);
  std::size_t pixels = 0;
  for (auto k = static_cast<std::size_t>(std::max(0, finest)); k < sizes.size(); ++k) {
    pixels += static_cast<std::size_t>(sizes[k].width) * sizes[k].height;
  }
  return std::max<std::size_t>(1, pixels) * sizeof(Rgb8);  // the single pixel at least
}

}  // namespace sherd
