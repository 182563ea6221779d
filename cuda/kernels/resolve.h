// n x n samples a pixel to one: colour averaged in linear light, planes from the sample nearest the
// pixel's centre (metaball/supersample.h does the same).
#pragma once

#include <cstddef>
#include <cstdint>

#include "metaball/frame.h"
#include "metaball/hostdevice.h"

namespace sherd::kernels {

struct ResolvePixels {
  int width, height;  // pixels
  int samples;        // n
  const Pixel* fine_color;
  const float* fine_depth;      // may be null, with its output
  const Vec3f* fine_normal;     // may be null
  const std::int32_t* fine_id;  // may be null
  Pixel* color;
  float* depth;
  Vec3f* normal;
  std::int32_t* id;

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::size_t stride = static_cast<std::size_t>(width) * samples;
    const std::size_t x = thread % width * samples;
    const std::size_t y = thread / width * samples;
    Pixel sum;
    for (int j = 0; j < samples; ++j) {
      const Pixel* row = fine_color + (y + j) * stride + x;
      for (int i = 0; i < samples; ++i) {
        sum.r += row[i].r;
        sum.g += row[i].g;
        sum.b += row[i].b;
        sum.a += row[i].a;
      }
    }
    const float weight = 1.0f / static_cast<float>(samples * samples);
    color[thread] = {sum.r * weight, sum.g * weight, sum.b * weight, sum.a * weight};
    const std::size_t middle = (y + samples / 2) * stride + x + samples / 2;
    if (depth) depth[thread] = fine_depth[middle];
    if (normal) normal[thread] = fine_normal[middle];
    if (id) id[thread] = fine_id[middle];
  }
};

}  // namespace sherd::kernels
