// The passes over a traced picture that colour and light it, a sample a thread: each a launch of
// its own, made only where the scene asks for it. The formulas are the views of
// metaball/appearance/.
#pragma once

#include <cstddef>
#include <cstdint>

#include "metaball/appearance/light_view.h"
#include "metaball/appearance/normal_view.h"
#include "metaball/appearance/quantity_view.h"
#include "metaball/appearance/surface_hit.h"
#include "metaball/appearance/texture_view.h"
#include "metaball/appearance/volume_texture.h"
#include "metaball/camera.h"
#include "metaball/frame.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd::kernels {

// The hits of a traced picture.
struct SurfaceSamples {
  Camera camera;  // world
  const float* depth = nullptr;
  const Vec3f* normal = nullptr;  // the field's
  Pixel* color = nullptr;

  // False where nothing is hit.
  SHERD_HD bool At(std::uint64_t sample, SurfaceHit* point) const {
    if (!(depth[sample] > 0.0f)) return false;
    *point =
        SurfaceHitAt(camera, depth, normal, camera.width, static_cast<int>(sample % camera.width),
                     static_cast<int>(sample / camera.width));
    return true;
  }
  SHERD_HD void SetColor(std::uint64_t sample, const Vec3f& c) const {
    color[sample] = {c.x, c.y, c.z, color[sample].a};
  }
};

// The normals that light falls on, where they are not the field's.
struct MapNormals {
  SurfaceSamples samples;
  NormalView normals;
  Vec3f* mapped;

  SHERD_HD void operator()(std::uint64_t sample) const {
    SurfaceHit point;
    mapped[sample] = samples.At(sample, &point) ? normals.NormalAt(point) : Vec3f{};
  }
};

struct ColorByQuantity {
  SurfaceSamples samples;
  QuantityView quantity;
  const Vec3f* mapped;  // normals

  SHERD_HD void operator()(std::uint64_t sample) const {
    SurfaceHit point;
    if (!samples.At(sample, &point)) return;
    samples.SetColor(sample, quantity.ColorAt(sample, point.position, mapped[sample]));
  }
};

struct ColorByTexture {
  SurfaceSamples samples;
  TextureView texture;

  SHERD_HD void operator()(std::uint64_t sample) const {
    SurfaceHit point;
    if (samples.At(sample, &point)) samples.SetColor(sample, texture.ColorAt(point));
  }
};

struct ColorByVolume {
  SurfaceSamples samples;
  VolumeView volume;

  SHERD_HD void operator()(std::uint64_t sample) const {
    SurfaceHit point;
    if (samples.At(sample, &point)) samples.SetColor(sample, volume.At(point.position));
  }
};

struct LightSurface {
  static constexpr int kThreads = 128;
  static constexpr int kBlocksPerMultiprocessor = 8;  // 64 registers

  SurfaceSamples samples;
  LightView light;
  const Vec3f* mapped;  // normals
  Vec3f* out_light;     // null where the plane is not asked for

  SHERD_HD void operator()(std::uint64_t sample) const {
    SurfaceHit point;
    const bool hit = samples.At(sample, &point);
    const Vec3f factor =
        hit ? light.At(sample, point.position, mapped[sample], point.to_viewer) : Vec3f{};
    if (out_light) out_light[sample] = factor;
    if (!hit || light.unlit) return;
    const Pixel& c = samples.color[sample];
    samples.SetColor(sample, ColorInLight({c.r, c.g, c.b}, factor));
  }
};

}  // namespace sherd::kernels
