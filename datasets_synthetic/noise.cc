#include "datasets_synthetic/noise.h"

#include <algorithm>
#include <cmath>

#include "datasets_synthetic/random.h"

namespace sherd::synthetic {
namespace {

// A cheap lattice hash (three odd multipliers and two rounds of mixing): enough for noise.
inline std::uint32_t LatticeHash(std::int32_t x, std::int32_t y, std::int32_t z,
                                 std::uint32_t seed) {
  std::uint32_t h = seed + static_cast<std::uint32_t>(x) * 0x8da6b343u +
                    static_cast<std::uint32_t>(y) * 0xd8163841u +
                    static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  return h ^ (h >> 15);
}

// The twelve edge directions of a cube, four of them twice.
constexpr float kDirections[16][3] = {
    {1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0}, {1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1},
    {0, 1, 1}, {0, -1, 1}, {0, 1, -1}, {0, -1, -1}, {1, 1, 0}, {-1, 1, 0}, {0, -1, 1}, {0, -1, -1}};

// Turns space so that no face of the scene is parallel to the lattice.
inline Vec3d Turned(const Vec3d& p) {
  return {0.36 * p.x + 0.48 * p.y - 0.8 * p.z, -0.8 * p.x + 0.6 * p.y,
          0.48 * p.x + 0.64 * p.y + 0.6 * p.z};
}
inline Vec3f TurnedBack(const Vec3f& v) {
  return {0.36f * v.x - 0.8f * v.y + 0.48f * v.z, 0.48f * v.x + 0.6f * v.y + 0.64f * v.z,
          -0.8f * v.x + 0.6f * v.z};
}

}  // namespace

NoiseSample GradientNoise(const Vec3d& p, std::uint32_t seed) {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto ix = static_cast<std::int32_t>(fx);
  const auto iy = static_cast<std::int32_t>(fy);
  const auto iz = static_cast<std::int32_t>(fz);
  const float x = static_cast<float>(p.x - fx);
  const float y = static_cast<float>(p.y - fy);
  const float z = static_cast<float>(p.z - fz);
  const auto fade = [](float t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); };
  const auto slope = [](float t) { return 30.0f * t * t * (t * (t - 2.0f) + 1.0f); };
  const float wx[2] = {1.0f - fade(x), fade(x)};
  const float wy[2] = {1.0f - fade(y), fade(y)};
  const float wz[2] = {1.0f - fade(z), fade(z)};
  const float sx = slope(x), sy = slope(y), sz = slope(z);
  const float dx[2] = {-sx, sx}, dy[2] = {-sy, sy}, dz[2] = {-sz, sz};
  NoiseSample s;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 2; ++i) {
        const float* g = kDirections[LatticeHash(ix + i, iy + j, iz + k, seed) & 15u];
        const float v = g[0] * (x - static_cast<float>(i)) + g[1] * (y - static_cast<float>(j)) +
                        g[2] * (z - static_cast<float>(k));
        const float w = wx[i] * wy[j] * wz[k];
        s.value += w * v;
        s.gradient.x += w * g[0] + dx[i] * wy[j] * wz[k] * v;
        s.gradient.y += w * g[1] + wx[i] * dy[j] * wz[k] * v;
        s.gradient.z += w * g[2] + wx[i] * wy[j] * dz[k] * v;
      }
    }
  }
  return s;
}

NoiseSample Fbm(const Vec3d& p, double wavelength_m, int octaves, float gain, double footprint_m,
                std::uint32_t seed) {
  NoiseSample sum;
  float amplitude = 1.0f;
  double wavelength = wavelength_m;
  const Vec3d q = Turned(p);
  for (int o = 0; o < octaves; ++o) {
    if (wavelength <= 2.0 * footprint_m) break;
    float weight = amplitude;
    if (wavelength < 4.0 * footprint_m) {
      weight *= static_cast<float>(wavelength / (2.0 * footprint_m) - 1.0);
    }
    const double frequency = 1.0 / wavelength;
    const NoiseSample s = GradientNoise(q * frequency, seed + 101u * static_cast<unsigned>(o));
    sum.value += weight * s.value;
    sum.gradient += (weight * static_cast<float>(frequency)) * s.gradient;
    amplitude *= gain;
    wavelength *= 0.5;
  }
  sum.gradient = TurnedBack(sum.gradient);
  return sum;
}

Grain FindGrain(const Vec3d& p, double cell_m, double density, double footprint_m,
                std::uint32_t seed) {
  Grain grain;
  const double mean_radius = 0.25 * cell_m;
  if (mean_radius < 0.5 * footprint_m) return grain;
  const Vec3d q = Turned(p) * (1.0 / cell_m);
  const double fx = std::floor(q.x), fy = std::floor(q.y), fz = std::floor(q.z);
  const std::uint64_t hash =
      Mix64((static_cast<std::uint64_t>(LatticeHash(static_cast<std::int32_t>(fx),
                                                    static_cast<std::int32_t>(fy),
                                                    static_cast<std::int32_t>(fz), seed))
             << 20) ^
            seed);
  const auto bits = [hash](int shift) {
    return static_cast<double>((hash >> shift) & 0x3ffu) * (1.0 / 1024.0);
  };
  if (bits(0) >= density) return grain;
  // The grain stays inside its cell, so that no neighbour needs to be looked at.
  const double radius = 0.14 + 0.22 * bits(10) * bits(10);
  const double room = 1.0 - 2.0 * radius * 1.15;
  const double mx = radius * 1.15 + room * bits(20), my = radius * 1.15 + room * bits(30);
  const double mz = radius * 1.15 + room * bits(40);
  // Flattened on one axis and stretched on another, with a bumpy outline.
  const double stretch = 0.75 + 0.35 * bits(50);
  Vec3d d{(q.x - fx - mx) / radius, (q.y - fy - my) / (radius * stretch),
          (q.z - fz - mz) / (radius * (1.6 - stretch * 0.6) * 0.9)};
  const float wobble = GradientNoise(q * 3.1 + Vec3d{bits(10) * 9, 0, 0}, seed + 7u).value;
  const double r = Length(d) * (1.0 + 0.22 * static_cast<double>(wobble));
  const double edge = std::max(0.08, footprint_m / (radius * cell_m));
  grain.coverage = static_cast<float>(1.0 - SmoothStep(1.0 - 0.5 * edge, 1.0 + 0.5 * edge, r));
  grain.coverage *= static_cast<float>(std::clamp(mean_radius / footprint_m - 0.5, 0.0, 1.0));
  grain.random = static_cast<float>(UnitOf(Mix64(hash)));
  grain.dome = TurnedBack(d.cast<float>());
  return grain;
}

}  // namespace sherd::synthetic
