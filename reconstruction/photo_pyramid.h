// A photograph as MIP levels. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metaball/color.h"
#include "metaball/vec.h"

namespace sherd {

// 8-bit sRGB, row-major. Level k of a photograph is 2^k times smaller on each side (the last column
// and row of an odd size are averaged with fewer pixels), averaged in linear light.
struct PhotoLevel {
  int width = 0, height = 0;
  std::vector<Rgb8> pixels;
};

class PhotoPyramid {
 public:
  // Decodes the file, keeping levels `finest` and coarser: no finer one is ever held whole. Throws
  // InputError naming the file.
  static PhotoPyramid Read(const std::string& path, int finest);

  int finest() const { return finest_; }
  // The size of level 0, whether it is held or not.
  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t MemoryBytes() const;
  // Bytes that Read(path, finest) of a photograph of this size will hold.
  static std::size_t BytesFor(int width, int height, int finest);

  // Linear colour at (x, y), pixels of level 0 with pixel centres at (0.5, 0.5), clamped to the
  // picture; between two levels, `level` >= 0.
  Vec3f Sample(float x, float y, float level) const;
  // The same of one level by Catmull and Rom's cubic: for pictures finer than the photograph. Not
  // negative.
  Vec3f SampleSharply(float x, float y, int level) const;

  const std::vector<PhotoLevel>& levels() const { return levels_; }

 private:
  Vec3f SampleLevel(const PhotoLevel& level, float x, float y) const;
  int finest_ = 0, width_ = 0, height_ = 0;
  std::vector<PhotoLevel> levels_;  // levels_[i] is level finest_ + i
};

// The encoded byte of a linear value in [0, 1], exact to a quarter of a step.
std::uint8_t EncodeLinear(float v);

}  // namespace sherd
