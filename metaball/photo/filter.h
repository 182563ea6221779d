// How a photograph's pixels make a colour: one text for every way they are held and every machine.
//
// `Texels` is a photograph as MIP levels, level k 2^k times smaller on each side than the file:
//   int finest() const, coarsest() const     the levels that are held
//   auto At(int level) const                 one of them: width, height, and operator()(x, y), the
//                                            linear colour of a pixel in it
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "metaball/hostdevice.h"
#include "metaball/photo/lookup.h"
#include "metaball/vec.h"

namespace sherd {

// What a lookup is asked for, linear.
struct PhotoColors {
  Vec3f footprint{}, surroundings{};
};

// The colours of a photograph whose exposure is evened out; gain: factors by channel.
SHERD_HD PhotoColors WithGain(const PhotoColors& c, const Vec3f& gain) {
  return {{c.footprint.x * gain.x, c.footprint.y * gain.y, c.footprint.z * gain.z},
          {c.surroundings.x * gain.x, c.surroundings.y * gain.y, c.surroundings.z * gain.z}};
}

// 2^-level; level in [0, 31].
SHERD_HD float LevelScale(int level) {
  return 1.0f / static_cast<float>(std::uint32_t{1} << level);
}

// The colour of one level at (x, y), its own pixels with centres at (0.5, 0.5), bilinear; clamped
// to the picture.
template <class LevelTexels>
SHERD_HD Vec3f SampleBilinear(const LevelTexels& at, float x, float y) {
  x = std::clamp(x - 0.5f, 0.0f, static_cast<float>(at.width - 1));
  y = std::clamp(y - 0.5f, 0.0f, static_cast<float>(at.height - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, at.width - 1), y1 = std::min(y0 + 1, at.height - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const Vec3f top = at(x0, y0) * (1 - fx) + at(x1, y0) * fx;
  const Vec3f bottom = at(x0, y1) * (1 - fx) + at(x1, y1) * fx;
  return top * (1 - fy) + bottom * fy;
}

// Catmull and Rom's cubic at t in [0, 1] between the second and the third of four pixels.
SHERD_HD void CubicWeights(float t, float* w) {
  w[0] = t * (-0.5f + t * (1 - 0.5f * t));
  w[1] = 1 + t * t * (-2.5f + 1.5f * t);
  w[2] = t * (0.5f + t * (2 - 1.5f * t));
  w[3] = t * t * (-0.5f + 0.5f * t);
}

// The same by the cubic: for pictures finer than the photograph. Not negative.
template <class LevelTexels>
SHERD_HD Vec3f SampleCubic(const LevelTexels& at, float x, float y) {
  x = std::clamp(x - 0.5f, 0.0f, static_cast<float>(at.width - 1));
  y = std::clamp(y - 0.5f, 0.0f, static_cast<float>(at.height - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  float wx[4], wy[4];
  CubicWeights(x - static_cast<float>(x0), wx);
  CubicWeights(y - static_cast<float>(y0), wy);
  Vec3f sum{};
  for (int j = 0; j < 4; ++j) {
    const int py = std::clamp(y0 + j - 1, 0, at.height - 1);
    for (int k = 0; k < 4; ++k) {
      const int px = std::clamp(x0 + k - 1, 0, at.width - 1);
      sum += at(px, py) * (wx[k] * wy[j]);
    }
  }
  return {std::max(sum.x, 0.0f), std::max(sum.y, 0.0f), std::max(sum.z, 0.0f)};
}

// The colour at (x, y), pixels of the file, of the held level nearest `level`: bilinear between the
// two levels around it (Williams 1983), or by the cubic in one.
template <class Texels>
SHERD_HD Vec3f SampleTexels(const Texels& texels, float x, float y, float level) {
  const float span = static_cast<float>(texels.coarsest() - texels.finest());
  const float l = std::clamp(level - static_cast<float>(texels.finest()), 0.0f, span);
  const int lower = texels.finest() + static_cast<int>(l);
  const float f = l - static_cast<float>(static_cast<int>(l));
  const float scale = LevelScale(lower);
  const Vec3f a = SampleBilinear(texels.At(lower), x * scale, y * scale);
  if (!(f > 0) || lower + 1 > texels.coarsest()) return a;
  const float half = LevelScale(lower + 1);
  return a * (1 - f) + SampleBilinear(texels.At(lower + 1), x * half, y * half) * f;
}
template <class Texels>
SHERD_HD Vec3f SampleTexelsSharply(const Texels& texels, float x, float y, int level) {
  const int held = std::clamp(level, texels.finest(), texels.coarsest());
  const float scale = LevelScale(held);
  return SampleCubic(texels.At(held), x * scale, y * scale);
}

// The mean colour over the footprint. Where only levels coarser than the lookup's are held, these
// are sampled.
template <class Texels>
SHERD_HD Vec3f SampleFootprint(const Texels& texels, const PhotoLookup& lookup) {
  const int n = lookup.along, m = lookup.across;
  if (n == 1 && m == 1) return SampleTexelsSharply(texels, lookup.x, lookup.y, lookup.level);
  Vec3f sum{};
  for (int i = 0; i < n; ++i) {
    const float s = (static_cast<float>(i) + 0.5f) / static_cast<float>(n) - 0.5f;
    for (int j = 0; j < m; ++j) {
      const float t = (static_cast<float>(j) + 0.5f) / static_cast<float>(m) - 0.5f;
      sum += SampleTexels(texels, lookup.x + s * lookup.along_x + t * lookup.across_x,
                          lookup.y + s * lookup.along_y + t * lookup.across_y,
                          static_cast<float>(lookup.level));
    }
  }
  return sum * (1.0f / static_cast<float>(n * m));
}

// The colour around the footprint, smoothed over a width of eight footprints; of no level finer
// than the lookup's own, which are not held for it.
template <class Texels>
SHERD_HD Vec3f SampleSurroundings(const Texels& texels, const PhotoLookup& lookup) {
  const float width = std::log2(std::max(1.0f, lookup.width_px));
  return SampleTexels(texels, lookup.x, lookup.y,
                      std::max(width + kSurroundingsOctaves, static_cast<float>(lookup.level)));
}

template <class Texels>
SHERD_HD PhotoColors SampleColors(const Texels& texels, const PhotoLookup& lookup) {
  return {SampleFootprint(texels, lookup), SampleSurroundings(texels, lookup)};
}

}  // namespace sherd
