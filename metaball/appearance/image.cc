#include "metaball/appearance/image.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

ImageLevelView LevelViewOf(const Image& image) {
  return {image.width, image.height, image.bytes.data(), image.floats.data()};
}

void Append(const Vec3f& v, Image* image) {
  switch (image->encoding) {
    case ImageEncoding::kSrgb8:
      image->bytes.push_back(Rgb8FromLinear(v));
      return;
    case ImageEncoding::kData8:
      image->bytes.push_back({Quantize8(v.x), Quantize8(v.y), Quantize8(v.z)});
      return;
    case ImageEncoding::kFloat:
      image->floats.push_back(v);
  }
}

// The pixels of one row or column that a pixel of the half as large image covers, and how much of
// each: two pixels, or three where the count is odd.
struct Cover {
  int first = 0, count = 0;
  float weight[3] = {};
};

Cover CoverOf(int k, int from, int to) {
  const double begin = static_cast<double>(k) * from / to;
  const double end = static_cast<double>(k + 1) * from / to;
  Cover cover;
  cover.first = static_cast<int>(begin);
  for (int i = cover.first; i < from && i < end && cover.count < 3; ++i) {
    const double part = std::min<double>(i + 1, end) - std::max<double>(i, begin);
    if (!(part > 1e-9)) continue;
    cover.weight[cover.count++] = static_cast<float>(part / (end - begin));
  }
  return cover;
}

Image Halved(const Image& image) {
  Image half;
  half.width = std::max(1, image.width / 2);
  half.height = std::max(1, image.height / 2);
  half.encoding = image.encoding;
  const ImageLevelView pixels = LevelViewOf(image);
  const ImageView view{&pixels, 1, image.encoding, SrgbToLinearTable()};
  (image.encoding == ImageEncoding::kFloat ? half.floats.reserve(half.pixels())
                                           : half.bytes.reserve(half.pixels()));
  for (int y = 0; y < half.height; ++y) {
    const Cover rows = CoverOf(y, image.height, half.height);
    for (int x = 0; x < half.width; ++x) {
      const Cover columns = CoverOf(x, image.width, half.width);
      Vec3f sum{};
      for (int j = 0; j < rows.count; ++j) {
        for (int i = 0; i < columns.count; ++i) {
          sum += view.Texel(pixels, columns.first + i, rows.first + j) *
                 (rows.weight[j] * columns.weight[i]);
        }
      }
      Append(sum, &half);
    }
  }
  return half;
}

}  // namespace

ImagePyramid::ImagePyramid(Image image) {
  const std::size_t stored =
      image.encoding == ImageEncoding::kFloat ? image.floats.size() : image.bytes.size();
  if (image.width < 1 || image.height < 1 || stored != image.pixels()) {
    throw Error("an image of " + std::to_string(image.width) + " x " +
                std::to_string(image.height) + " pixels cannot hold " + std::to_string(stored));
  }
  levels_.push_back(std::move(image));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    levels_.push_back(Halved(levels_.back()));
  }
  for (const Image& level : levels_) views_.push_back(LevelViewOf(level));
}

std::size_t ImagePyramid::MemoryBytes() const {
  std::size_t bytes = 0;
  for (const Image& level : levels_) {
    bytes += level.bytes.capacity() * sizeof(Rgb8) + level.floats.capacity() * sizeof(Vec3f);
  }
  return bytes;
}

ImageView ImagePyramid::view() const {
  return {views_.data(), levels(), levels_[0].encoding, SrgbToLinearTable()};
}

}  // namespace sherd
