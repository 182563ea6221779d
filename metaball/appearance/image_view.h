// Lookups in an image's pyramid at any footprint, on the CPU and on the GPU: pointers to what an
// ImagePyramid holds (image.h), or to a copy of it on a device.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "metaball/color.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

enum class ImageEncoding {
  kSrgb8,  // colours as photographs hold them; filtered in linear light
  kData8,  // 0..255 for 0..1 without a curve: normal maps
  kFloat,  // linear values as they are
};

// What a pixel of the picture covers in an image, as changes of (u, v) from one pixel to the next.
struct UvFootprint {
  float dudx = 0, dvdx = 0, dudy = 0, dvdy = 0;
};

// width x height pixels, both >= 1, row-major from the upper-left one.
struct ImageLevelView {
  int width = 0, height = 0;
  const Rgb8* bytes = nullptr;    // not read for kFloat
  const Vec3f* floats = nullptr;  // for kFloat alone
};

struct ImageView {
  const ImageLevelView* level = nullptr;  // the image itself first, each further one halved
  int levels = 0;                         // >= 1 where anything is looked up
  ImageEncoding encoding = ImageEncoding::kSrgb8;
  const float* linear_from_srgb = nullptr;  // 256 values (color.h)

  static constexpr int kMostSamples = 8;

  // Linear light of one pixel.
  SHERD_HD Vec3f Texel(const ImageLevelView& image, int x, int y) const {
    const std::size_t i = static_cast<std::size_t>(y) * image.width + x;
    switch (encoding) {
      case ImageEncoding::kSrgb8:
        return LinearFromRgb8(image.bytes[i], linear_from_srgb);
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

  // Linear light at (u, v): u to the right from the left edge, v up from the lower edge, 1 the
  // image's width and height. Outside [0, 1] the image repeats or its border goes on. Trilinear;
  // along the longer axis of the footprint up to kMostSamples samples are averaged, so that a
  // surface seen at an angle does not blur in its other direction.
  SHERD_HD Vec3f Sample(float u, float v, const UvFootprint& footprint, bool repeat_u,
                        bool repeat_v) const {
    // Whole repetitions are taken off so that far coordinates keep their accuracy; other
    // coordinates are brought near the image, whose border goes on for ever.
    if (!std::isfinite(u) || !std::isfinite(v)) u = v = 0.0f;
    u = repeat_u ? u - std::floor(u) : std::clamp(u, -1.0f, 2.0f);
    v = repeat_v ? v - std::floor(v) : std::clamp(v, -1.0f, 2.0f);
    // The footprint is the parallelogram of (a, b) and (c, d), in pixels of the image; its axes are
    // those of the ellipse that the matrix makes of a circle.
    const auto w = static_cast<float>(level[0].width), h = static_cast<float>(level[0].height);
    const float a = footprint.dudx * w, b = footprint.dvdx * h;
    const float c = footprint.dudy * w, d = footprint.dvdy * h;
    const float xx = a * a + c * c, yy = b * b + d * d, xy = a * b + c * d;
    const float middle = 0.5f * (xx + yy);
    const float spread = std::sqrt(0.25f * (xx - yy) * (xx - yy) + xy * xy);
    const float longer = std::sqrt(middle + spread);
    const float shorter = std::sqrt(std::max(middle - spread, 0.0f));
    if (!(longer > 1.0f) || !std::isfinite(longer)) {
      return Trilinear(std::isfinite(longer) ? 0.0f : static_cast<float>(levels), u, v, repeat_u,
                       repeat_v);
    }
    const float width_px = std::max(std::max(shorter, longer / kMostSamples), 1.0f);
    const float fineness = std::log2(width_px);
    const int needed = static_cast<int>(std::ceil(longer / width_px - 0.01f));
    const int samples = needed < 1 ? 1 : needed > kMostSamples ? kMostSamples : needed;
    if (samples == 1) return Trilinear(fineness, u, v, repeat_u, repeat_v);
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
      sum += Trilinear(fineness, u + t * axis_x, v + t * axis_y, repeat_u, repeat_v);
    }
    return sum * (1.0f / static_cast<float>(samples));
  }

 private:
  static SHERD_HD int Wrapped(int i, int n, bool repeat) {
    if (!repeat) return std::clamp(i, 0, n - 1);
    i %= n;
    return i < 0 ? i + n : i;
  }

  SHERD_HD Vec3f Bilinear(const ImageLevelView& image, float u, float v, bool repeat_u,
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

  // at: 0 for the image itself, 1 for its half, and all between; clamped to the levels there are.
  SHERD_HD Vec3f Trilinear(float at, float u, float v, bool repeat_u, bool repeat_v) const {
    at = std::clamp(at, 0.0f, static_cast<float>(levels - 1));
    const int fine = static_cast<int>(at);
    const float part = at - static_cast<float>(fine);
    const Vec3f c = Bilinear(level[fine], u, v, repeat_u, repeat_v);
    if (!(part > 0.0f)) return c;
    return c * (1.0f - part) + Bilinear(level[fine + 1], u, v, repeat_u, repeat_v) * part;
  }
};

}  // namespace sherd
