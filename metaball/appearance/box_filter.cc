#include "metaball/appearance/box_filter.h"

#include <algorithm>
#include <cstddef>
#include <string>

#include "metaball/error.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

// Sums in double: a running sum of floats would drift along a row.
struct Sum {
  double r = 0, g = 0, b = 0, a = 0;
  void Add(const Pixel& p, double sign) {
    r += sign * p.r;
    g += sign * p.g;
    b += sign * p.b;
    a += sign * p.a;
  }
  Pixel Mean(int count) const {
    const double scale = 1.0 / count;
    return {static_cast<float>(r * scale), static_cast<float>(g * scale),
            static_cast<float>(b * scale), static_cast<float>(a * scale)};
  }
};

constexpr int kColumns = 64;  // columns one task filters side by side

}  // namespace

void CheckFilterSize(int size) {
  if (size < 1 || size > 11 || size % 2 == 0) {
    throw Error("a box filter is 1, 3, 5, 7, 9 or 11 pixels wide, not " + std::to_string(size));
  }
}

void BoxFilter(int width, int height, int size, std::vector<Pixel>* color, int threads) {
  CheckFilterSize(size);
  if (size == 1 || width < 1 || height < 1) return;
  const int reach = size / 2;
  std::vector<Pixel> rows(color->size());
  ParallelFor(height, threads, [&](std::int64_t y, int) {
    const Pixel* from = color->data() + y * width;
    Pixel* to = rows.data() + y * width;
    Sum sum;
    for (int x = 0; x < std::min(reach, width); ++x) sum.Add(from[x], 1);
    for (int x = 0; x < width; ++x) {
      if (x + reach < width) sum.Add(from[x + reach], 1);
      if (x - reach - 1 >= 0) sum.Add(from[x - reach - 1], -1);
      to[x] = sum.Mean(std::min(x + reach, width - 1) - std::max(x - reach, 0) + 1);
    }
  });
  ParallelFor((width + kColumns - 1) / kColumns, threads, [&](std::int64_t part, int) {
    const int x0 = static_cast<int>(part) * kColumns, x1 = std::min(x0 + kColumns, width);
    std::vector<Sum> sums(static_cast<std::size_t>(x1 - x0));
    const auto add_row = [&](int y, double sign) {
      const Pixel* from = rows.data() + static_cast<std::size_t>(y) * width;
      for (int x = x0; x < x1; ++x) sums[static_cast<std::size_t>(x - x0)].Add(from[x], sign);
    };
    for (int y = 0; y < std::min(reach, height); ++y) add_row(y, 1);
    for (int y = 0; y < height; ++y) {
      if (y + reach < height) add_row(y + reach, 1);
      if (y - reach - 1 >= 0) add_row(y - reach - 1, -1);
      const int count = std::min(y + reach, height - 1) - std::max(y - reach, 0) + 1;
      Pixel* to = color->data() + static_cast<std::size_t>(y) * width;
      for (int x = x0; x < x1; ++x) to[x] = sums[static_cast<std::size_t>(x - x0)].Mean(count);
    }
  });
}

}  // namespace sherd
