// The colour that photographs of one place make together, on the CPU and on the GPU.
#pragma once

#include <algorithm>
#include <cmath>

#include "metaball/hostdevice.h"
#include "metaball/photo/filter.h"
#include "metaball/photo/photo_choice.h"
#include "metaball/vec.h"

namespace sherd {

// What is finer than a lookup's surroundings is taken from the best photograph almost alone, what
// is coarser is blended from all (Burt and Adelson's idea with two bands, over weights instead of
// masks), with little say for one whose surroundings contradict the others'. weight[k] > 0 and
// color[k]: of n lookups of one place, 1 .. kMostPhotos. Linear; not negative.
SHERD_HD Vec3f BlendPhotos(const float* weight, const PhotoColors* color, int n) {
  constexpr float kSharpness = 3;  // exponent of the fine band's weights
  // A photograph whose surroundings differ from the others' median by this much (natural logarithm)
  // has half its weight.
  constexpr float kDisagreement = 0.35f;
  float own[kMostPhotos], luma[kMostPhotos];
  int order[kMostPhotos];  // by luma
  float most = 0;
  for (int k = 0; k < n; ++k) {
    const Vec3f& c = color[k].surroundings;
    own[k] = weight[k];
    luma[k] = std::log(0.01f + (0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z));
    most = std::max(most, weight[k]);
    int at = k;
    for (; at > 0 && luma[order[at - 1]] > luma[k]; --at) order[at] = order[at - 1];
    order[at] = k;
  }
  if (n > 2) {
    // The weighted median, each photograph's say between the square root of its weight and it.
    float total = 0, passed = 0, median = luma[order[0]];
    for (int k = 0; k < n; ++k) total += std::sqrt(own[k] / most);
    for (int k = 0; k < n; ++k) {
      passed += std::sqrt(own[order[k]] / most);
      if (passed >= total / 2) {
        median = luma[order[k]];
        break;
      }
    }
    for (int k = 0; k < n; ++k) {
      const float off = (luma[k] - median) / kDisagreement;
      own[k] /= 1 + off * off;
    }
  }
  Vec3f coarse{}, fine{};
  float coarse_weight = 0, fine_weight = 0;
  for (int k = 0; k < n; ++k) {
    const float sharp = std::pow(own[k] / most, kSharpness);
    coarse += color[k].surroundings * own[k];
    coarse_weight += own[k];
    fine += (color[k].footprint - color[k].surroundings) * sharp;
    fine_weight += sharp;
  }
  const Vec3f c = coarse * (1 / coarse_weight) + fine * (1 / std::max(fine_weight, 1e-30f));
  return {std::max(c.x, 0.0f), std::max(c.y, 0.0f), std::max(c.z, 0.0f)};
}

}  // namespace sherd
