// A photograph as MIP levels in memory.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "metaball/color.h"
#include "metaball/vec.h"

namespace sherd {

// 8-bit sRGB, row-major. Level k of a photograph is 2^k times smaller on each side, rounded up at
// each halving.
struct PhotoLevel {
  int width = 0, height = 0;
  std::vector<Rgb8> pixels;
};

// The size of the next coarser level.
inline int HalvedSide(int side) { return (side + 1) / 2; }
struct LevelSize {
  int width, height;
};
// Of all levels, from the photograph's own size down to a single pixel.
std::vector<LevelSize> LevelSizes(int width, int height);

class PhotoPyramid {
 public:
  // width, height: of level 0, whether it is held or not. levels[i] is level finest + i, the last
  // of them a single pixel.
  PhotoPyramid(int width, int height, int finest, std::vector<PhotoLevel> levels)
      : finest_(finest), width_(width), height_(height), levels_(std::move(levels)) {}

  int finest() const { return finest_; }
  int coarsest() const { return finest_ + static_cast<int>(levels_.size()) - 1; }
  int width() const { return width_; }
  int height() const { return height_; }
  const std::vector<PhotoLevel>& levels() const { return levels_; }
  std::size_t MemoryBytes() const;
  // Bytes of pixels of a photograph of this size whose levels from `finest` on are held.
  static std::size_t BytesFor(int width, int height, int finest);

  // The texels of filter.h.
  struct LevelTexels {
    int width, height;
    const Rgb8* pixels;
    const float* linear;  // of each encoded byte
    Vec3f operator()(int x, int y) const {
      const Rgb8 c = pixels[static_cast<std::size_t>(y) * width + x];
      return {linear[c.r], linear[c.g], linear[c.b]};
    }
  };
  LevelTexels At(int level) const {
    const PhotoLevel& l = levels_[static_cast<std::size_t>(level - finest_)];
    return {l.width, l.height, l.pixels.data(), SrgbToLinearTable()};
  }

  // Linear colour at (x, y), pixels of level 0 with pixel centres at (0.5, 0.5), clamped to the
  // picture; between two levels, `level` >= 0.
  Vec3f Sample(float x, float y, float level) const;
  // The same of one level by the cubic: for pictures finer than the photograph.
  Vec3f SampleSharply(float x, float y, int level) const;

 private:
  int finest_, width_, height_;
  std::vector<PhotoLevel> levels_;
};

}  // namespace sherd
