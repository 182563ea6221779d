// n x n samples a pixel to one (metaball/supersample.h does the same): colour averaged in linear
// light, other planes from the sample nearest the pixel's centre.
#pragma once

#include <cstddef>
#include <cstdint>

#include "metaball/frame.h"
#include "metaball/hostdevice.h"

namespace sherd::kernels {

// One thread a pixel.
struct ResolveColor {
  int width;    // pixels
  int samples;  // n
  const Pixel* fine;
  Pixel* color;

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::size_t stride = static_cast<std::size_t>(width) * samples;
    const std::size_t x = thread % width * samples;
    const std::size_t y = thread / width * samples;
    Pixel sum;
    for (int j = 0; j < samples; ++j) {
      const Pixel* row = fine + (y + j) * stride + x;
      for (int i = 0; i < samples; ++i) {
        sum.r += row[i].r;
        sum.g += row[i].g;
        sum.b += row[i].b;
        sum.a += row[i].a;
      }
    }
    const float weight = 1.0f / static_cast<float>(samples * samples);
    color[thread] = {sum.r * weight, sum.g * weight, sum.b * weight, sum.a * weight};
  }
};

// One thread a component of a pixel.
template <class T>
struct TakeMiddle {
  int width, samples, components;
  const T* fine;
  T* plane;

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::uint64_t pixel = thread / components;
    const std::size_t stride = static_cast<std::size_t>(width) * samples;
    const std::size_t x = pixel % width * samples + samples / 2;
    const std::size_t y = pixel / width * samples + samples / 2;
    plane[thread] = fine[(y * stride + x) * components + thread % components];
  }
};

}  // namespace sherd::kernels
