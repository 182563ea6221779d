#include "metaball/frame.h"

#include <algorithm>

namespace sherd {

std::size_t Planes::BytesPerPixel() const {
  return sizeof(Pixel) + (depth ? sizeof(float) : 0) + (normal ? sizeof(Vec3f) : 0) +
         (id ? sizeof(std::int32_t) : 0) + (light ? sizeof(Vec3f) : 0) +
         (weight ? sizeof(float) : 0) + (intensity ? sizeof(float) : 0) +
         (influence ? sizeof(Vec3f) : 0) + channels.size() * 4 * sizeof(float) +
         uv.size() * sizeof(SurfaceUv);
}

RenderStats& RenderStats::operator+=(const RenderStats& other) {
  backend = other.backend;
  device = other.device;
  metaballs = std::max(metaballs, other.metaballs);
  metaballs_in_view = std::max(metaballs_in_view, other.metaballs_in_view);
  tile_entries += other.tile_entries;
  rays += other.rays;
  hits += other.hits;
  rays_started_inside += other.rays_started_inside;
  grazing += other.grazing;
  unresolved += other.unresolved;
  seconds_prepare += other.seconds_prepare;
  seconds_bin += other.seconds_bin;
  seconds_trace += other.seconds_trace;
  seconds_total += other.seconds_total;
  bytes = std::max(bytes, other.bytes);
  lod_metaballs = std::max(lod_metaballs, other.lod_metaballs);
  lod_error_px = std::max(lod_error_px, other.lod_error_px);
  lod_seconds += other.lod_seconds;
  lod_bytes = std::max(lod_bytes, other.lod_bytes);
  lod_note = other.lod_note;
  return *this;
}

void Frame::Clear(int x0, int y0, int x1, int y1) {
  const int begin = std::clamp(x0, 0, width), end = std::clamp(x1, begin, width);
  for (int y = std::max(y0, 0); y < std::min(y1, height); ++y) {
    const std::size_t first = static_cast<std::size_t>(y) * width + begin;
    const std::size_t count = static_cast<std::size_t>(end - begin);
    const auto clear = [&](auto* plane, const auto& nothing, std::size_t components = 1) {
      if (!plane->empty())
        std::fill_n(plane->begin() + first * components, count * components, nothing);
    };
    clear(&color, Pixel{});
    clear(&depth, 0.0f);
    clear(&normal, Vec3f{});
    clear(&id, -1);
    clear(&light, Vec3f{});
    clear(&weight, 0.0f);
    clear(&intensity, 0.0f);
    clear(&influence, Vec3f{});
    for (ChannelPlane& channel : channels) {
      clear(&channel.values, 0.0f, static_cast<std::size_t>(channel.components));
    }
    for (UvPlane& plane : uv) clear(&plane.values, SurfaceUv{});
  }
}

}  // namespace sherd
