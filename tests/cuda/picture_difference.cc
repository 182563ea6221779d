#include "picture_difference.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace sherd {
namespace {

// The values of a plane are weighted sums of floats, taken in another order or fused.
constexpr float kWeight = 2e-3f, kNormal = 5e-3f, kInfluence = 5e-3f, kChannel = 4e-3f, kUv = 2e-3f,
                kUvGradient = 2e-2f;

// True for NaN as well.
bool Apart(float a, float b, float tolerance) { return !(std::abs(a - b) <= tolerance); }
bool Apart(const Vec3f& a, const Vec3f& b, float tolerance) {
  return !(Length(a - b) <= tolerance);
}
bool Apart(const Pixel& a, const Pixel& b, float tolerance) {
  return Apart(a.r, b.r, tolerance) || Apart(a.g, b.g, tolerance) || Apart(a.b, b.b, tolerance) ||
         Apart(a.a, b.a, tolerance);
}
bool Apart(const SurfaceUv& a, const SurfaceUv& b) {
  // Coordinates that wrap may lie on either side of the seam.
  const float around = a.u - b.u;
  return Apart(around, std::round(around), kUv) || Apart(a.v, b.v, kUv) ||
         Apart(a.du, b.du, kUvGradient) || Apart(a.dv, b.dv, kUvGradient);
}
bool Apart(const ChannelPlane& a, const ChannelPlane& b, std::size_t i) {
  const auto n = static_cast<std::size_t>(a.components);
  for (std::size_t at = n * i; at < n * (i + 1); ++at) {
    if (Apart(a.values[at], b.values[at], kChannel)) return true;
  }
  return false;
}

template <class T>
bool SameSize(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size();
}

std::string DifferenceOfShape(const Frame& a, const Frame& b) {
  if (a.width != b.width || a.height != b.height || !SameSize(a.color, b.color)) return "size";
  bool same = SameSize(a.depth, b.depth) && SameSize(a.normal, b.normal) && SameSize(a.id, b.id) &&
              SameSize(a.light, b.light) && SameSize(a.weight, b.weight) &&
              SameSize(a.intensity, b.intensity) && SameSize(a.influence, b.influence) &&
              SameSize(a.channels, b.channels) && SameSize(a.uv, b.uv);
  for (std::size_t k = 0; same && k < a.channels.size(); ++k) {
    const ChannelPlane &p = a.channels[k], &q = b.channels[k];
    same = p.name == q.name && p.components == q.components && SameSize(p.values, q.values);
  }
  for (std::size_t k = 0; same && k < a.uv.size(); ++k) {
    same = a.uv[k].channel == b.uv[k].channel && SameSize(a.uv[k].values, b.uv[k].values);
  }
  return same ? "" : "planes";
}

bool PlanesApart(const Frame& a, const Frame& b, std::size_t i) {
  bool apart = (!a.normal.empty() && Apart(a.normal[i], b.normal[i], kNormal)) ||
               (!a.light.empty() && Apart(a.light[i], b.light[i], kNormal)) ||
               (!a.weight.empty() && Apart(a.weight[i], b.weight[i], kWeight)) ||
               (!a.intensity.empty() && Apart(a.intensity[i], b.intensity[i], kWeight)) ||
               (!a.influence.empty() && Apart(a.influence[i], b.influence[i], kInfluence));
  for (std::size_t k = 0; k < a.channels.size(); ++k) {
    apart = apart || Apart(a.channels[k], b.channels[k], i);
  }
  for (std::size_t k = 0; k < a.uv.size(); ++k) {
    apart = apart || Apart(a.uv[k].values[i], b.uv[k].values[i]);
  }
  return apart;
}

}  // namespace

PictureDifference ComparePictures(const Frame& expected, const Frame& frame,
                                  const PictureTolerance& tolerance) {
  PictureDifference d;
  d.pixels = expected.color.size();
  d.shape = DifferenceOfShape(expected, frame);
  if (!d.shape.empty()) return d;
  for (std::size_t i = 0; i < expected.color.size(); ++i) {
    d.drawn += expected.color[i].a > 0;
    d.color_off += Apart(expected.color[i], frame.color[i], tolerance.color);
    if (!expected.depth.empty() &&
        Apart(expected.depth[i], frame.depth[i], static_cast<float>(tolerance.depth))) {
      ++d.elsewhere;
      continue;
    }
    d.planes_off += PlanesApart(expected, frame, i);
    d.ids_off += !expected.id.empty() && expected.id[i] != frame.id[i];
  }
  return d;
}

}  // namespace sherd
