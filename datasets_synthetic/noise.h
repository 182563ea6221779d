// Procedural noise with derivatives, limited to what a pixel can show: every function takes the
// footprint of a pixel on the surface and leaves out what is finer.
#pragma once

#include <cstdint>

#include "metaball/vec.h"

namespace sherd::synthetic {

struct NoiseSample {
  float value = 0;   // about [-1, 1]
  Vec3f gradient{};  // d value / d position, per metre
};

// Gradient noise (Perlin 2002) on a lattice of 1 m.
NoiseSample GradientNoise(const Vec3d& p, std::uint32_t seed);

// `octaves` of gradient noise from `wavelength_m` downwards, each half as long and `gain` times as
// high as the one before. Octaves shorter than four footprints fade out, and are gone at two.
NoiseSample Fbm(const Vec3d& p, double wavelength_m, int octaves, float gain, double footprint_m,
                std::uint32_t seed);

// A stone, crumb or fleck of a scattering of irregular grains through space.
struct Grain {
  float coverage = 0;  // [0, 1]: how much of the pixel it fills
  float random = 0;    // [0, 1): the grain's own number, for its colour
  Vec3f dome{};        // from the grain's middle, in units of its radius (length <= about 1)
};

// The grain at p of a scattering with one grain at most in each cell of `cell_m`, present with
// probability `density`. Coverage goes to zero as the grains become smaller than a pixel.
Grain FindGrain(const Vec3d& p, double cell_m, double density, double footprint_m,
                std::uint32_t seed);

// 0 below `from`, 1 above `to`, smooth between; from < to.
inline double SmoothStep(double from, double to, double x) {
  const double t = (x - from) / (to - from);
  if (t <= 0) return 0;
  if (t >= 1) return 1;
  return t * t * (3 - 2 * t);
}

}  // namespace sherd::synthetic
