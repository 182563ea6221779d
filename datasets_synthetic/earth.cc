// Earth: layers as an excavator sees them in section and on the floor, and the turf above.
#include <algorithm>
#include <array>
#include <cmath>

#include "datasets_synthetic/materials.h"
#include "datasets_synthetic/noise.h"

namespace sherd::synthetic {
namespace {

// A layer, its lower boundary, and the grains in it.
struct Layer {
  double bottom;         // z of its lower boundary, metres
  double unevenness;     // of that boundary
  Vec3f color;           // linear
  float mottling;        // strength of its light and dark patches
  double grain_density;  // share of cells with a grain
  Vec3f grain_dark, grain_light;
};

constexpr std::array<Layer, 6> kLayers{{
    {-0.15,
     0.030,
     {0.075f, 0.052f, 0.033f},
     0.9f,
     0.20,
     {0.05f, 0.04f, 0.03f},
     {0.26f, 0.22f, 0.17f}},
    {-0.40,
     0.040,
     {0.150f, 0.100f, 0.060f},
     0.8f,
     0.35,
     {0.07f, 0.05f, 0.04f},
     {0.34f, 0.28f, 0.21f}},
    {-0.50,
     0.022,
     {0.058f, 0.048f, 0.040f},
     0.9f,
     0.45,
     {0.015f, 0.014f, 0.013f},
     {0.30f, 0.13f, 0.06f}},
    {-0.69,
     0.035,
     {0.270f, 0.215f, 0.150f},
     0.7f,
     0.75,
     {0.20f, 0.17f, 0.13f},
     {0.52f, 0.48f, 0.40f}},
    {-1.04,
     0.045,
     {0.225f, 0.138f, 0.068f},
     0.8f,
     0.35,
     {0.08f, 0.05f, 0.03f},
     {0.42f, 0.35f, 0.26f}},
    {-9.00,
     0.000,
     {0.305f, 0.222f, 0.122f},
     0.6f,
     0.80,
     {0.16f, 0.13f, 0.10f},
     {0.48f, 0.42f, 0.33f}},
}};

// Lays a scattering of grains over a surface.
void Scatter(const Vec3d& p, double cell, double density, double footprint, std::uint32_t seed,
             const Vec3f& dark, const Vec3f& light, Surface* s) {
  const Grain g = FindGrain(p, cell, density, footprint, seed);
  if (!(g.coverage > 0)) return;
  // Each grain has a tone of its own and is lighter on its crown.
  const float crown = 1.08f - 0.22f * std::min(1.0f, Dot(g.dome, g.dome));
  const Vec3f color = Mix(dark, light, g.random) * crown;
  s->albedo = Mix(s->albedo, color, 0.92f * g.coverage);
  s->relief += (-0.55f * g.coverage) * g.dome;
}

}  // namespace

Surface Materials::Earth(const Vec3d& p, const Vec3d& normal, double footprint) const {
  const double outside = Terrain::OutlineDistance(p.x, p.y);
  const bool above = outside > 0.0 && p.z > -0.12;
  float bare = 0;
  Surface turf;
  if (above) {
    turf = Turf(p, footprint, &bare);
    if (bare <= 0) return turf;
  }

  // Boundaries wander; a softer, frayed one looks natural and hides the mesh.
  const double wander =
      static_cast<double>(Fbm({p.x, p.y, 0.15 * p.z}, 1.1, 3, 0.5f, footprint, seed_ + 201).value);
  const NoiseSample mottle = Fbm(p, 0.16, 4, 0.6f, footprint, seed_ + 202);
  const double fray = 0.014 * static_cast<double>(mottle.value);
  const double softness = std::max(0.010, footprint);
  Layer layer = kLayers[0];
  for (std::size_t i = 1; i < kLayers.size(); ++i) {
    const Layer& upper = kLayers[i - 1];
    const double bottom = upper.bottom +
                          upper.unevenness * 2.0 * wander * (i % 2 == 0 ? 1.0 : -0.7) +
                          0.012 * p.y + fray;
    const float t = static_cast<float>(SmoothStep(-softness, softness, bottom - p.z));
    if (t <= 0) break;
    layer.color = Mix(layer.color, kLayers[i].color, t);
    layer.mottling += (kLayers[i].mottling - layer.mottling) * t;
    layer.grain_density +=
        (kLayers[i].grain_density - layer.grain_density) * static_cast<double>(t);
    layer.grain_dark = Mix(layer.grain_dark, kLayers[i].grain_dark, t);
    layer.grain_light = Mix(layer.grain_light, kLayers[i].grain_light, t);
  }
  const auto fill = [&](double distance, const Vec3f& color, float strength) {
    const float t = strength * static_cast<float>(SmoothStep(-softness, softness, fray - distance));
    layer.color = Mix(layer.color, color, t);
  };
  const Vec3f dark_fill{0.070f, 0.054f, 0.040f};
  // A ditch cut from under the subsoil shows in the northern and the southern section.
  if (p.z < -0.2) {
    const double middle = -1.32 + 0.12 * p.y;
    const double half = 0.42 * std::sqrt(std::max(0.0, 1.0 - std::max(0.0, -0.24 - p.z) / 0.55));
    const double top = p.z + 0.24 - 0.5 * fray;
    fill(std::max({std::abs(p.x - middle) - half, top, 1.36 - std::abs(p.y)}), dark_fill, 0.85f);
  }
  if (outside < -0.02) {
    fill(GraveCutDistance(p.x, p.y) - 0.01, dark_fill, 0.75f);
    for (const PostHole& hole : kPostHoles) {
      fill(std::hypot(p.x - hole.x, p.y - hole.y) - hole.radius - 0.012, dark_fill, 0.8f);
    }
    // The hearth: ash and charcoal inside, earth burnt red around it.
    const double hearth =
        std::hypot(p.x - Hearth::x, p.y - Hearth::y) + 0.05 * static_cast<double>(mottle.value);
    if (hearth < 0.6 && p.z < -0.7) {
      const float red = static_cast<float>(1 - SmoothStep(0.30, 0.50, hearth));
      const float ash = static_cast<float>(1 - SmoothStep(0.14, 0.25, hearth));
      layer.color = Mix(layer.color, Vec3f{0.24f, 0.085f, 0.04f}, 0.75f * red);
      layer.color = Mix(layer.color, Vec3f{0.045f, 0.043f, 0.042f}, 0.9f * ash);
      const float pale =
          ash * static_cast<float>(SmoothStep(0.1, 0.5, static_cast<double>(mottle.value)));
      layer.color = Mix(layer.color, Vec3f{0.33f, 0.32f, 0.30f}, 0.6f * pale);
    }
  }

  Surface s;
  // Damp and dry patches, mottling, then crumbs down to the pixel.
  const float damp = Fbm(p, 0.7, 2, 0.5f, footprint, seed_ + 203).value;
  const NoiseSample crumb = Fbm(p, 0.022, 5, 0.72f, footprint, seed_ + 204);
  const float tone =
      std::exp2(0.35f * damp + 0.45f * layer.mottling * mottle.value + 0.62f * crumb.value);
  const float warm = 0.10f * damp + 0.06f * mottle.value;
  s.albedo = Times(layer.color * tone, Vec3f{1 + warm, 1.0f, 1 - warm});
  s.relief = 0.012f * mottle.gradient + 0.0042f * crumb.gradient;
  // Fine trowel strokes across the sections.
  if (std::abs(normal.z) < 0.5 && !above) {
    const NoiseSample stroke = Fbm({p.x * 0.35, p.y * 0.35, p.z * 2.2 + 0.2 * (p.x + p.y)}, 0.05, 3,
                                   0.6f, footprint, seed_ + 205);
    s.albedo = s.albedo * (1.0f + 0.22f * stroke.value);
  }
  const double density = layer.grain_density;
  Scatter(p, 0.0065, 0.55 * density, footprint, seed_ + 206, layer.grain_dark, layer.grain_light,
          &s);
  Scatter(p, 0.013, 0.50 * density, footprint, seed_ + 207, layer.grain_dark, layer.grain_light,
          &s);
  Scatter(p, 0.029, 0.40 * density, footprint, seed_ + 208, layer.grain_dark, layer.grain_light,
          &s);
  Scatter(p, 0.061, 0.16 * density, footprint, seed_ + 209, layer.grain_dark, layer.grain_light,
          &s);
  // Charcoal, and a crumb of brick or burnt clay here and there.
  Scatter(p, 0.019, 0.035, footprint, seed_ + 210, {0.012f, 0.011f, 0.01f}, {0.03f, 0.028f, 0.026f},
          &s);
  Scatter(p, 0.024, 0.020, footprint, seed_ + 211, {0.28f, 0.09f, 0.04f}, {0.42f, 0.17f, 0.08f},
          &s);
  if (above && bare < 1) {
    s.albedo = Mix(turf.albedo, s.albedo, bare);
    s.relief = Mix(turf.relief, s.relief, bare);
  }
  return s;
}

Surface Materials::Turf(const Vec3d& p, double footprint, float* bare) const {
  const double outside = Terrain::OutlineDistance(p.x, p.y);
  const float patches = Fbm(p, 0.9, 4, 0.6f, footprint, seed_ + 221).value;
  // Trodden bare along the rim; islands of bare earth farther out.
  const double edge = outside - 0.16 + 0.30 * static_cast<double>(patches);
  const double islands = 0.42 - static_cast<double>(patches);
  *bare = static_cast<float>(1 - SmoothStep(-0.08, 0.10, std::min(edge, islands)));
  Surface s;
  const float dry = Fbm(p, 2.3, 3, 0.55f, footprint, seed_ + 222).value;
  const NoiseSample tuft = Fbm(p, 0.11, 3, 0.65f, footprint, seed_ + 223);
  // Blades: noise drawn out in two directions that change from place to place.
  const double angle = 2.5 * static_cast<double>(patches) + 0.8 * static_cast<double>(tuft.value);
  const double c = std::cos(angle), n = std::sin(angle);
  const Vec3d along{(c * p.x + n * p.y) * 0.22, -n * p.x + c * p.y, p.z};
  const Vec3d across{c * p.x + n * p.y, (-n * p.x + c * p.y) * 0.22, p.z};
  const NoiseSample blade = Fbm(along, 0.012, 3, 0.75f, footprint, seed_ + 224);
  const NoiseSample blade2 = Fbm(across, 0.014, 3, 0.75f, footprint, seed_ + 225);
  const float light = std::max(blade.value, blade2.value);
  const Vec3f fresh{0.070f, 0.115f, 0.030f}, straw{0.240f, 0.205f, 0.095f};
  const float straw_share =
      std::clamp(0.42f + 0.75f * dry + 0.5f * light + 0.25f * tuft.value, 0.0f, 1.0f);
  s.albedo = Mix(fresh, straw, straw_share) * std::exp2(0.5f * tuft.value + 1.25f * light - 0.15f);
  s.relief = 0.010f * tuft.gradient + 0.0016f * (blade.gradient + blade2.gradient);
  Scatter(p, 0.045, 0.05, footprint, seed_ + 226, {0.16f, 0.10f, 0.04f}, {0.35f, 0.27f, 0.14f}, &s);
  return s;
}

}  // namespace sherd::synthetic
