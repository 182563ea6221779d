// Images as plain data, and their pyramids for lookups at any footprint. Files are read elsewhere.
#pragma once

#include <cstddef>
#include <vector>

#include "metaball/color.h"
#include "metaball/vec.h"

namespace sherd {

enum class ImageEncoding {
  kSrgb8,  // colours as photographs hold them; filtered in linear light
  kData8,  // 0..255 for 0..1 without a curve: normal maps
  kFloat,  // linear values as they are
};

struct Image {
  int width = 0, height = 0;  // both >= 1
  ImageEncoding encoding = ImageEncoding::kSrgb8;
  std::vector<Rgb8> bytes;    // row-major from the upper-left pixel; empty for kFloat
  std::vector<Vec3f> floats;  // for kFloat alone

  std::size_t pixels() const { return static_cast<std::size_t>(width) * height; }
};

// What a pixel of the picture covers in an image, as changes of (u, v) from one pixel to the next.
struct UvFootprint {
  float dudx = 0, dvdx = 0, dudy = 0, dvdy = 0;
};

// An image and its halvings (box filter in linear light, down to 1 x 1). Immutable, thread-safe.
class ImagePyramid {
 public:
  // Throws Error for a size that does not match the pixels.
  explicit ImagePyramid(Image image);

  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }
  std::size_t MemoryBytes() const;
  int levels() const { return static_cast<int>(levels_.size()); }
  const Image& level(int k) const { return levels_[static_cast<std::size_t>(k)]; }

  // Linear light at (u, v): u to the right from the left edge, v up from the lower edge, 1 the
  // image's width and height. Outside [0, 1] the image repeats or its border goes on. Trilinear;
  // along the longer axis of the footprint up to kMostSamples samples are averaged, so that a
  // surface seen at an angle does not blur in its other direction.
  Vec3f Sample(float u, float v, const UvFootprint& footprint, bool repeat_u, bool repeat_v) const;

  static constexpr int kMostSamples = 8;

 private:
  Vec3f Bilinear(const Image& image, float u, float v, bool repeat_u, bool repeat_v) const;
  Vec3f Trilinear(float level, float u, float v, bool repeat_u, bool repeat_v) const;

  std::vector<Image> levels_;
};

}  // namespace sherd
