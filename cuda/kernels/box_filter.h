// A box filter over a picture that has a border of half the box on every side (thesis 4.3,
// metaball/appearance/box_filter.h): rows first, then columns. Sums in doubles, as there.
#pragma once

#include <cstddef>
#include <cstdint>

#include "metaball/frame.h"
#include "metaball/hostdevice.h"

namespace sherd::kernels {

// The mean of `size` pixels, `step` apart.
SHERD_HD Pixel MeanOf(const Pixel* first, int size, std::size_t step) {
  double r = 0, g = 0, b = 0, a = 0;
  for (int k = 0; k < size; ++k) {
    const Pixel& p = first[static_cast<std::size_t>(k) * step];
    r += p.r;
    g += p.g;
    b += p.b;
    a += p.a;
  }
  const double scale = 1.0 / size;
  return {static_cast<float>(r * scale), static_cast<float>(g * scale),
          static_cast<float>(b * scale), static_cast<float>(a * scale)};
}

// One thread a pixel of the result, which is size - 1 narrower than the picture.
struct FilterRows {
  const Pixel* picture;
  int width;  // of the result
  int size;   // of the box
  Pixel* rows;

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::size_t x = thread % width, y = thread / width;
    rows[thread] = MeanOf(picture + y * (width + size - 1) + x, size, 1);
  }
};

// The same for columns: size - 1 lower.
struct FilterColumns {
  const Pixel* rows;
  int width, size;
  Pixel* filtered;

  SHERD_HD void operator()(std::uint64_t thread) const {
    filtered[thread] = MeanOf(rows + thread, size, static_cast<std::size_t>(width));
  }
};

}  // namespace sherd::kernels
