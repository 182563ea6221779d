#include "metaball/appearance/image.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

Vec3f Texel(const Image& image, int x, int y) {
  const std::size_t i = static_cast<std::size_t>(y) * image.width + x;
  switch (image.encoding) {
    case ImageEncoding::kSrgb8:
      return LinearFromRgb8(image.bytes[i]);
    case ImageEncoding::kData8: {
      const Rgb8 c = image.bytes[i];
      return Vec3f{static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)} *
             (1.0f / 255.0f);
    }
    case ImageEncoding::kFloat:
      break;
  }
  return image.floats[i];
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
  (image.encoding == ImageEncoding::kFloat ? half.floats.reserve(half.pixels())
                                           : half.bytes.reserve(half.pixels()));
  for (int y = 0; y < half.height; ++y) {
    const Cover rows = CoverOf(y, image.height, half.height);
    for (int x = 0; x < half.width; ++x) {
      const Cover columns = CoverOf(x, image.width, half.width);
      Vec3f sum{};
      for (int j = 0; j < rows.count; ++j) {
        for (int i = 0; i < columns.count; ++i) {
          sum += Texel(image, columns.first + i, rows.first + j) *
                 (rows.weight[j] * columns.weight[i]);
        }
      }
      Append(sum, &half);
    }
  }
  return half;
}

int Wrapped(int i, int n, bool repeat) {
  if (!repeat) return std::clamp(i, 0, n - 1);
  i %= n;
  return i < 0 ? i + n : i;
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
}

std::size_t ImagePyramid::MemoryBytes() const {
  std::size_t bytes = 0;
  for (const Image& level : levels_) {
    bytes += level.bytes.capacity() * sizeof(Rgb8) + level.floats.capacity() * sizeof(Vec3f);
  }
  return bytes;
}

Vec3f ImagePyramid::Bilinear(const Image& image, float u, float v, bool repeat_u,
                             bool repeat_v) const {
  const float x = u * static_cast<float>(image.width) - 0.5f;
  const float y = (1.0f - v) * static_cast<float>(image.height) - 0.5f;
  const float left = std::floor(x), top = std::floor(y);
  const float fx = x - left, fy = y - top;
  const int x0 = Wrapped(static_cast<int>(left), image.width, repeat_u);
  const int x1 = Wrapped(static_cast<int>(left) + 1, image.width, repeat_u);
  const int y0 = Wrapped(static_cast<int>(top), image.height, repeat_v);
  const int y1 = Wrapped(static_cast<int>(top) + 1, image.height, repeat_v);
  return (Texel(image, x0, y0) * (1.0f - fx) + Texel(image, x1, y0) * fx) * (1.0f - fy) +
         (Texel(image, x0, y1) * (1.0f - fx) + Texel(image, x1, y1) * fx) * fy;
}

Vec3f ImagePyramid::Trilinear(float level, float u, float v, bool repeat_u, bool repeat_v) const {
  const auto top = static_cast<float>(levels() - 1);
  level = std::clamp(level, 0.0f, top);
  const auto fine = static_cast<std::size_t>(level);
  const float part = level - static_cast<float>(fine);
  const Vec3f c = Bilinear(levels_[fine], u, v, repeat_u, repeat_v);
  if (!(part > 0.0f)) return c;
  return c * (1.0f - part) + Bilinear(levels_[fine + 1], u, v, repeat_u, repeat_v) * part;
}

Vec3f ImagePyramid::Sample(float u, float v, const UvFootprint& footprint, bool repeat_u,
                           bool repeat_v) const {
  // Whole repetitions are taken off so that far coordinates keep their accuracy; other coordinates
  // are brought near the image, whose border goes on for ever.
  if (!std::isfinite(u) || !std::isfinite(v)) u = v = 0.0f;
  u = repeat_u ? u - std::floor(u) : std::clamp(u, -1.0f, 2.0f);
  v = repeat_v ? v - std::floor(v) : std::clamp(v, -1.0f, 2.0f);
  // The footprint is the parallelogram of (a, b) and (c, d), in pixels of the image; its axes are
  // those of the ellipse that the matrix makes of a circle.
  const auto w = static_cast<float>(width()), h = static_cast<float>(height());
  const float a = footprint.dudx * w, b = footprint.dvdx * h;
  const float c = footprint.dudy * w, d = footprint.dvdy * h;
  const float xx = a * a + c * c, yy = b * b + d * d, xy = a * b + c * d;
  const float middle = 0.5f * (xx + yy);
  const float spread = std::sqrt(0.25f * (xx - yy) * (xx - yy) + xy * xy);
  const float longer = std::sqrt(middle + spread);
  const float shorter = std::sqrt(std::max(middle - spread, 0.0f));
  if (!(longer > 1.0f) || !std::isfinite(longer)) {
    return Trilinear(std::isfinite(longer) ? 0.0f : static_cast<float>(levels()), u, v, repeat_u,
                     repeat_v);
  }
  const float width_px = std::max({shorter, longer / kMostSamples, 1.0f});
  const float level = std::log2(width_px);
  const int samples =
      std::clamp(static_cast<int>(std::ceil(longer / width_px - 0.01f)), 1, kMostSamples);
  if (samples == 1) return Trilinear(level, u, v, repeat_u, repeat_v);
  // The longer axis: the eigenvector of [xx xy; xy yy] for middle + spread.
  float axis_x = xy, axis_y = middle + spread - xx;
  if (std::abs(axis_x) + std::abs(axis_y) < 1e-6f * middle) {
    axis_x = xx >= yy ? 1.0f : 0.0f;
    axis_y = 1.0f - axis_x;
  }
  const float scale = longer / std::sqrt(axis_x * axis_x + axis_y * axis_y);
  axis_x *= scale / w;
  axis_y *= scale / h;
  Vec3f sum{};
  for (int k = 0; k < samples; ++k) {
    const float t = (static_cast<float>(k) + 0.5f) / static_cast<float>(samples) - 0.5f;
    sum += Trilinear(level, u + t * axis_x, v + t * axis_y, repeat_u, repeat_v);
  }
  return sum * (1.0f / static_cast<float>(samples));
}

}  // namespace sherd
