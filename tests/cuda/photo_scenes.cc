#include "photo_scenes.h"

#include <cmath>
#include <utility>

namespace sherd {
namespace {

// Wellons' lowbias32: one that a line can hold.
std::uint32_t Hash(std::uint32_t x) {
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  return x ^ x >> 16;
}
double Uniform(std::uint32_t i) { return Hash(i) / 4294967296.0; }

}  // namespace

PhotoPyramid MakeNoisePhoto(int width, int height, int finest, std::uint32_t seed) {
  std::vector<PhotoLevel> levels;
  const std::vector<LevelSize> sizes = LevelSizes(width, height);
  for (auto k = static_cast<std::size_t>(finest); k < sizes.size(); ++k) {
    PhotoLevel noise{sizes[k].width, sizes[k].height, {}};
    const auto count = static_cast<std::uint32_t>(noise.width) * noise.height;
    noise.pixels.reserve(count);
    const std::uint32_t start = Hash(seed * 32 + static_cast<std::uint32_t>(k));
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t bits = Hash(start + i);
      noise.pixels.push_back({static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8),
                              static_cast<std::uint8_t>(bits >> 16)});
    }
    levels.push_back(std::move(noise));
  }
  return {width, height, finest, std::move(levels)};
}

std::vector<PhotoLookup> MakeLookups(std::uint32_t photo, int width, int height,
                                     std::size_t count) {
  std::vector<PhotoLookup> lookups(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto n = static_cast<std::uint32_t>(8 * i + 977 * photo);
    PhotoLookup& lookup = lookups[i];
    lookup.photo = photo;
    lookup.target = static_cast<std::uint32_t>(i);
    lookup.x = static_cast<float>((1.1 * Uniform(n) - 0.05) * width);
    lookup.y = static_cast<float>(
        (1.1 * (static_cast<double>(i) + 0.5) / static_cast<double>(count) - 0.05) * height);
    const double size = 0.25 * std::pow(400, Uniform(n + 1));
    const double stretch = std::pow(30, Uniform(n + 2));
    const double turn = 2 * M_PI * Uniform(n + 3);
    const double skew = 0.5 * Uniform(n + 4);
    const double ax = std::cos(turn) * size, ay = std::sin(turn) * size;
    SetFootprint(ax, ay, (skew * ax - ay) / stretch, (skew * ay + ax) / stretch, &lookup);
  }
  return lookups;
}

}  // namespace sherd
