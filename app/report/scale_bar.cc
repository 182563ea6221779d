#include "app/report/scale_bar.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "metaball/median.h"

namespace sherd {

std::optional<ScaleBar> MakeScaleBar(const Camera& camera, double depth, double metres_per_unit,
                                     double max_px) {
  const double pixel_m = camera.PixelSizeAt(depth) * metres_per_unit;
  if (!(pixel_m > 0) || !std::isfinite(pixel_m) || !(max_px >= 10)) return std::nullopt;
  const double longest = pixel_m * max_px;
  double power = std::pow(10.0, std::floor(std::log10(longest)));
  if (power > longest * (1 + 1e-12)) power /= 10;  // log10 rounded up
  ScaleBar bar;
  for (const int digit : {5, 2, 1}) {
    if (digit * power > longest * (1 + 1e-12)) continue;
    bar.metres = digit * power;
    bar.segments = digit == 2 ? 4 : 5;
    break;
  }
  bar.length_px = bar.metres / pixel_m;
  // Half a unit in the tenth digit: 0.01 made by pow is still one centimetre.
  constexpr double kSlack = 1 - 1e-10;
  if (bar.metres >= 1000 * kSlack) {
    bar.unit = "km";
    bar.label_end = bar.metres / 1000;
  } else if (bar.metres >= kSlack) {
    bar.unit = "m";
    bar.label_end = bar.metres;
  } else if (bar.metres >= 0.01 * kSlack) {
    bar.unit = "cm";
    bar.label_end = bar.metres * 100;
  } else {
    bar.unit = "mm";
    bar.label_end = bar.metres * 1000;
  }
  return bar;
}

std::optional<double> DepthAtCenter(const Camera& camera, const Frame& frame) {
  const std::size_t pixels =
      static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  if (pixels == 0 || frame.depth.size() != pixels) return std::nullopt;
  const int largest = std::max(frame.width, frame.height);
  for (int half = std::max(2, largest / 40); half < 2 * largest; half *= 2) {
    std::vector<double> found;
    const int x0 = std::max(0, frame.width / 2 - half);
    const int x1 = std::min(frame.width, frame.width / 2 + half + 1);
    const int y0 = std::max(0, frame.height / 2 - half);
    const int y1 = std::min(frame.height, frame.height / 2 + half + 1);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const float distance =
            frame.depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                        static_cast<std::size_t>(x)];
        if (!(distance > 0)) continue;
        const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
        found.push_back(distance * Dot(ray.direction, camera.forward));
      }
    }
    if (!found.empty()) return Median(std::move(found));
  }
  return std::nullopt;
}

}  // namespace sherd
