// thesis 3.5 and 3.6: the normal that light falls on, on the CPU and on the GPU.
#pragma once

#include <algorithm>

#include "metaball/appearance/appearance.h"
#include "metaball/appearance/surface_hit.h"
#include "metaball/appearance/texture_view.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// An appearance's normals prepared for one frame.
struct NormalView {
  NormalSource normal = NormalSource::kGradient;
  NormalMapSource map = NormalMapSource::kNone;
  const Vec3f* influence = nullptr;  // by pixel; for NormalSource::kInfluence
  const float* channel = nullptr;    // 3 a pixel; for NormalMapSource::kChannel
  TextureView image;                 // for NormalMapSource::kImage

  SHERD_HD Vec3f NormalAt(const SurfaceHit& point) const {
    Vec3f surface = point.normal;
    if (normal == NormalSource::kInfluence) {
      surface = Normalized(influence[point.pixel], surface);
    }
    Vec3f mapped{};
    switch (map) {
      case NormalMapSource::kNone:
        return surface;
      case NormalMapSource::kChannel: {
        const float* v = channel + point.pixel * 3;
        mapped = {v[0], v[1], v[2]};
        break;
      }
      case NormalMapSource::kImage: {
        SurfaceHit at = point;
        at.normal = surface;
        Vec3f along_u, along_v;
        const Vec3f c = image.ValueAt(at, &along_u, &along_v);
        const float z = std::max(2.0f * c.z - 1.0f, 0.0f);
        mapped = along_u * (2.0f * c.x - 1.0f) + along_v * (2.0f * c.y - 1.0f) + surface * z;
        break;
      }
    }
    if (!IsFinite(mapped)) return surface;
    // The half in (N_surface + N_map) / 2 falls out of the unit vector.
    return Normalized(surface + mapped, surface);
  }
};

}  // namespace sherd
