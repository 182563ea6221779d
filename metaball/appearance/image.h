// Images as plain data, and their pyramids for lookups at any footprint. Files are read elsewhere.
#pragma once

#include <cstddef>
#include <vector>

#include "metaball/appearance/image_view.h"
#include "metaball/color.h"
#include "metaball/vec.h"

namespace sherd {

struct Image {
  int width = 0, height = 0;  // both >= 1
  ImageEncoding encoding = ImageEncoding::kSrgb8;
  std::vector<Rgb8> bytes;    // row-major from the upper-left pixel; empty for kFloat
  std::vector<Vec3f> floats;  // for kFloat alone

  std::size_t pixels() const { return static_cast<std::size_t>(width) * height; }
};

// An image and its halvings (box filter in linear light, down to 1 x 1). Immutable, thread-safe.
class ImagePyramid {
 public:
  // Throws Error for a size that does not match the pixels.
  explicit ImagePyramid(Image image);
  // Not copied: views point into it. What is moved keeps its pixels where they are.
  ImagePyramid(ImagePyramid&&) = default;
  ImagePyramid& operator=(ImagePyramid&&) = default;

  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }
  std::size_t MemoryBytes() const;
  int levels() const { return static_cast<int>(levels_.size()); }
  const Image& level(int k) const { return levels_[static_cast<std::size_t>(k)]; }

  // Valid while the pyramid lives.
  ImageView view() const;
  // As ImageView::Sample.
  Vec3f Sample(float u, float v, const UvFootprint& footprint, bool repeat_u, bool repeat_v) const {
    return view().Sample(u, v, footprint, repeat_u, repeat_v);
  }

 private:
  std::vector<Image> levels_;
  std::vector<ImageLevelView> views_;  // of the levels
};

}  // namespace sherd
