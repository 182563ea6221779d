#include "datasets_synthetic/materials.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "datasets_synthetic/noise.h"

namespace sherd::synthetic {
namespace {

constexpr Vec3f kDirt{0.17f, 0.115f, 0.07f};

float Unit(double v) { return static_cast<float>(std::clamp(v, 0.0, 1.0)); }

// Share of the odd bands of `width` in a pixel at `x` (box filter over the footprint).
float BandShare(double x, double width, double footprint) {
  // Integral of the odd bands from 0 to t.
  const auto integral = [width](double t) {
    const double pair = std::floor(t / (2 * width));
    return pair * width + std::max(0.0, t - pair * 2 * width - width);
  };
  const double f = std::max(footprint, 1e-5);
  return static_cast<float>((integral(x + 0.5 * f) - integral(x - 0.5 * f)) / f);
}

}  // namespace

Surface Materials::At(const Part& part, const Vec3d& p, const Vec3d& normal,
                      double footprint_m) const {
  Surface s;
  switch (part.material) {
    case Material::kEarth:
      s = Earth(p, normal, footprint_m);
      break;
    case Material::kStone:
      s = Stone(part, p, footprint_m);
      break;
    case Material::kPottery:
      s = Pottery(part, p, normal, footprint_m);
      break;
    case Material::kPole:
      s = Pole(part, p, footprint_m);
      break;
    case Material::kScaleBar:
      s = ScaleBar(part, p, footprint_m);
      break;
    case Material::kBoard:
      s = Board(part, p, normal, footprint_m);
      break;
    case Material::kWood:
      s = Wood(part, p, footprint_m);
      break;
  }
  const auto bound = [](float v) { return std::clamp(v, 0.004f, 0.90f); };
  s.albedo = {bound(s.albedo.x), bound(s.albedo.y), bound(s.albedo.z)};
  return s;
}

Surface Materials::Stone(const Part& part, const Vec3d& p, double footprint) const {
  const std::uint32_t seed = part.seed;
  const Vec3d q = part.frame.ToLocal(p);
  Surface s;
  const NoiseSample mottle = Fbm(q, 0.09, 4, 0.6f, footprint, seed);
  const NoiseSample pits = Fbm(q, 0.014, 5, 0.7f, footprint, seed + 1);
  // Bedding planes, along the stone's flat direction.
  const NoiseSample bed = Fbm({q.x * 0.15, q.y * 0.15, q.z}, 0.030, 3, 0.6f, footprint, seed + 2);
  const float tone = std::exp2(0.55f * mottle.value + 0.60f * pits.value + 0.30f * bed.value);
  s.albedo = Times(part.color * tone, Vec3f{1 + 0.08f * mottle.value, 1, 1 - 0.1f * mottle.value});
  const auto to_world = [&](const Vec3f& g) {
    const Vec3d d = g.cast<double>();
    return (part.frame.x * d.x + part.frame.y * d.y + part.frame.z * d.z).cast<float>();
  };
  s.relief = to_world(0.009f * mottle.gradient + 0.0040f * pits.gradient);
  // Cracks, where a smooth field changes its sign.
  const NoiseSample crack = Fbm(q, 0.13, 3, 0.5f, footprint, seed + 3);
  const float slope = std::max(Length(crack.gradient), 1e-3f);
  const float crack_m = std::abs(crack.value) / slope;
  const double half_width = std::max(0.0009, 0.5 * footprint);
  const float dark = static_cast<float>(
      (1 - SmoothStep(0.5 * half_width, 1.5 * half_width, static_cast<double>(crack_m))) *
      std::min(1.0, 0.0009 / half_width));
  s.albedo = s.albedo * (1 - 0.65f * dark);
  // Lichen and lime, in blotches.
  const float lichen = Fbm(q, 0.05, 4, 0.65f, footprint, seed + 4).value;
  const float pale = static_cast<float>(SmoothStep(0.28, 0.50, static_cast<double>(lichen)));
  s.albedo = Mix(s.albedo, Vec3f{0.46f, 0.44f, 0.38f}, 0.55f * pale);
  // Earth that clings to it, more towards the ground and on the upper side.
  const double height = p.z - terrain_.FloorHeight(p.x, p.y);
  const float clinging = Fbm(p, 0.06, 4, 0.65f, footprint, seed_ + 231).value;
  const float dirt = Unit(0.55 - 3.2 * height + 0.9 * static_cast<double>(clinging));
  s.albedo = Mix(s.albedo, kDirt * (1 + 0.8f * pits.value), 0.8f * dirt);
  return s;
}

Surface Materials::Pottery(const Part& part, const Vec3d& p, const Vec3d& normal,
                           double footprint) const {
  const Vec3d q = part.frame.ToLocal(p);
  const std::uint32_t seed = part.seed;
  Surface s;
  const NoiseSample fabric = Fbm(q, 0.035, 5, 0.65f, footprint, seed);
  s.albedo = part.color * std::exp2(0.5f * fabric.value);
  s.relief = 0.0022f * fabric.gradient;
  // Wheel marks run round the axis; painted bands, and on the painted ones a row of strokes.
  const bool jar = part.size.y > 1.5;
  const double across = jar ? q.z : q.y;
  const float wheel =
      Fbm({0.05 * q.x, 0.05 * q.y, across}, 0.006, 2, 0.5f, footprint, seed + 1).value;
  s.albedo = s.albedo * (1 + 0.12f * wheel);
  const Vec3f slip{0.035f, 0.025f, 0.020f};
  if (part.size.y > 0.5) {
    const double soft = std::max(0.0006, footprint);
    const auto band = [&](double low, double high) {
      return static_cast<float>(SmoothStep(low - 0.5 * soft, low + 0.5 * soft, across) *
                                (1 - SmoothStep(high - 0.5 * soft, high + 0.5 * soft, across)));
    };
    const float worn = Unit(0.9 + 0.9 * static_cast<double>(fabric.value));
    float paint = 0;
    if (jar) {
      paint = std::max({band(0.188, 0.196), band(0.228, 0.234), band(0.085, 0.100)});
      const double turn = std::atan2(q.y, q.x) * 14 / std::numbers::pi;
      const double zigzag = 0.201 + 0.022 * std::abs(std::remainder(turn, 2.0));
      paint = std::max(paint, band(zigzag - 0.0028, zigzag + 0.0028));
    } else {
      const double shift = 0.4 * part.size.x * (part.seed % 7 / 3.0 - 1.0);
      paint = std::max(band(shift - 0.006, shift), band(shift + 0.004, shift + 0.006));
      if (part.seed % 3 == 0) {
        const double zigzag = shift + 0.012 + 0.010 * std::abs(std::remainder(q.x / 0.011, 2.0));
        paint = std::max(paint, band(zigzag - 0.0015, zigzag + 0.0015));
      }
    }
    s.albedo = Mix(s.albedo, slip, 0.85f * worn * paint);
  }
  // The fracture shows the core: greyer.
  if (!jar) {
    const float edge = Unit(1.6 - 2.6 * std::abs(Dot(normal, part.frame.z)));
    s.albedo = Mix(s.albedo, Vec3f{0.17f, 0.13f, 0.10f}, 0.6f * edge);
  }
  const Grain temper = FindGrain(q, 0.004, 0.25, footprint, seed + 2);
  s.albedo = Mix(s.albedo, Vec3f{0.5f, 0.46f, 0.4f}, 0.6f * temper.coverage);
  const float clinging = Fbm(p, 0.05, 4, 0.65f, footprint, seed_ + 232).value;
  const double height = p.z - terrain_.FloorHeight(p.x, p.y);
  const float dirt = Unit(0.35 - 6.0 * height + 1.2 * static_cast<double>(clinging));
  s.albedo = Mix(s.albedo, kDirt * (1 + 0.5f * fabric.value), 0.75f * dirt);
  return s;
}

Surface Materials::Pole(const Part& part, const Vec3d& p, double footprint) const {
  const Vec3d q = part.frame.ToLocal(p);
  Surface s;
  const float wear = Fbm(q, 0.03, 5, 0.65f, footprint, part.seed).value;
  if (q.z < 0) {
    s.albedo = Vec3f{0.22f, 0.22f, 0.23f} * (1 + 0.5f * wear);
    return s;
  }
  const float white = BandShare(q.z, 0.10, footprint);
  s.albedo =
      Mix(Vec3f{0.52f, 0.030f, 0.022f}, Vec3f{0.74f, 0.73f, 0.70f}, white) * (1 + 0.12f * wear);
  // Scratches and soil, most of it near the foot.
  const float scuff = Unit(static_cast<double>(wear) * 2.4 - 0.55 + 0.5 * std::exp(-q.z / 0.12));
  s.albedo = Mix(s.albedo, kDirt, 0.55f * scuff);
  return s;
}

Surface Materials::ScaleBar(const Part& part, const Vec3d& p, double footprint) const {
  const Vec3d q = part.frame.ToLocal(p);
  Surface s;
  const float wear = Fbm(q, 0.04, 5, 0.65f, footprint, part.seed).value;
  const float white = BandShare(q.x + part.size.x, 0.10, footprint);
  s.albedo =
      Mix(Vec3f{0.025f, 0.025f, 0.026f}, Vec3f{0.78f, 0.77f, 0.75f}, white) * (1 + 0.10f * wear);
  // The first 10 cm are divided into centimetres on one half of their width.
  if (q.x + part.size.x < 0.10 && q.y < 0 && q.z > 0) {
    const float fine = BandShare(q.x + part.size.x, 0.01, footprint);
    s.albedo =
        Mix(Vec3f{0.025f, 0.025f, 0.026f}, Vec3f{0.78f, 0.77f, 0.75f}, fine) * (1 + 0.10f * wear);
  }
  const float scuff = Unit(static_cast<double>(wear) * 2.2 - 0.65);
  s.albedo = Mix(s.albedo, kDirt, 0.5f * scuff);
  return s;
}

Surface Materials::Board(const Part& part, const Vec3d& p, const Vec3d& normal,
                         double footprint) const {
  const Vec3d q = board_frame_.ToLocal(p);
  Surface s;
  const float wear = Fbm(q, 0.12, 6, 0.6f, footprint, part.seed).value;
  if (Dot(normal, board_frame_.z) < 0.7) {  // edges and back
    s.albedo = Vec3f{0.40f, 0.31f, 0.21f} * (1 + 0.4f * wear);
    return s;
  }
  s.albedo = Vec3f{0.80f, 0.80f, 0.78f} * (1 + 0.03f * wear);
  // Dust and splashes, away from the letters' contrast: never darker than a fifth.
  const float dust = Unit(2.0 * static_cast<double>(wear) - 0.55);
  s.albedo = Mix(s.albedo, kDirt * 2.0f, 0.22f * dust);
  const float ink = board_.Ink(q.x, q.y, footprint);
  s.albedo = Mix(s.albedo, Vec3f{0.022f, 0.022f, 0.024f}, ink);
  return s;
}

Surface Materials::Wood(const Part& part, const Vec3d& p, double footprint) const {
  const Vec3d q = part.frame.ToLocal(p);
  Surface s;
  const float grain = Fbm({q.x, q.y, 0.06 * q.z}, 0.008, 4, 0.65f, footprint, part.seed).value;
  s.albedo = Vec3f{0.36f, 0.26f, 0.15f} * (1 + 0.5f * grain);
  return s;
}

}  // namespace sherd::synthetic
