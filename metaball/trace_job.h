// What the CPU's tile tracers share: one frame's inputs and outputs.
#pragma once

#include <cstdint>
#include <string>

#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/frame.h"
#include "metaball/shading.h"
#include "metaball/tile_binning.h"
#include "metaball/tile_march.h"

namespace sherd {

struct TraceJob {
  const Cloud* cloud = nullptr;
  Camera camera;  // local units
  const TileBins* bins = nullptr;
  FrameLight light;
  float threshold = 0.0f;
  float radius_scale = 1.0f;
  Frame* frame = nullptr;  // planes that are wanted are allocated

  TileList ListOf(int tile) const {
    TileList list;
    list.metaball = bins->list(tile);
    list.count = bins->count(tile);
    list.front = bins->front();
    list.center = cloud->center.data();
    list.radius = cloud->radius.empty() ? nullptr : cloud->radius.data();
    list.uniform_radius = cloud->uniform_radius;
    list.radius_scale = radius_scale;
    return list;
  }
};

struct TraceCounts {
  std::uint64_t hits = 0;
  RayCounts rays;
};

// Draws one tile, a ray at a time (tile_march.h).
void TraceTileScalar(const TraceJob& job, int tile, TraceCounts* counts);

#ifdef SHERD_HAVE_HIGHWAY
// The same in packets of rays with the widest vectors this machine has (packet_tracer.cc).
void TraceTilePackets(const TraceJob& job, int tile, TraceCounts* counts);
// "AVX-512" and so on: what TraceTilePackets runs on.
std::string PacketTargetName();
#endif

}  // namespace sherd
