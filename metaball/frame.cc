#include "metaball/frame.h"

#include <algorithm>

namespace sherd {

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
  return *this;
}

}  // namespace sherd
