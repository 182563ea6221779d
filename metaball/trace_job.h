// What the CPU's tile tracers share: one frame's inputs and outputs.
#pragma once

#include <cstdint>
#include <string>

#include "metaball/appearance/gather.h"
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
  DensityShape shape;
  ThresholdMode mode = ThresholdMode::kUniform;
  double threshold = 0.0;                 // the surface's own
  double threshold_scale = 1.0;           // 1 / the density's amplitude
  double radius_scale = 1.0;              // the surface's, times the density's support
  bool double_precision = false;          // floats cannot carry the scene (precision.h)
  int float_overlap = kFloatOverlap;      // beyond which packets of floats give a tile up
  Frame* frame = nullptr;                 // planes that are wanted are allocated
  const SurfaceGather* gather = nullptr;  // fills the planes of further channels; may be null

  TileList ListOf(int tile) const {
    TileList list;
    list.entry = bins->list(tile);
    list.count = bins->count(tile);
    list.center = cloud->center.data();
    list.radius = cloud->radius.empty() ? nullptr : cloud->radius.data();
    list.uniform_radius = cloud->uniform_radius;
    list.radius_scale = radius_scale;
    const bool own_threshold = mode != ThresholdMode::kUniform && !cloud->threshold.empty();
    list.threshold = own_threshold ? cloud->threshold.data() : nullptr;
    list.uniform_threshold = threshold;
    list.threshold_scale = threshold_scale;
    return list;
  }
};

struct TraceCounts {
  std::uint64_t hits = 0;
  RayCounts rays;
};

// Draws one tile. job.frame gets its pixels, counts what is counted. A tracer in floats that meets
// what floats cannot sum up counts it (RayCounts::crowded) and leaves the tile unfinished; counts
// begin with none of that.
using TileTracer = void (*)(const TraceJob& job, int tile, TraceCounts* counts);

// A ray at a time (tile_march.h): every density, every mode.
TileTracer ScalarTracerFor(const TraceJob& job);

// The same in packets of rays with the widest vectors this machine has (packet_tracer-inl.h); not
// in the core build, which is without Highway.
void TraceUniformPackets(const TraceJob& job, int tile, TraceCounts* counts);
void TraceUniformDoublePackets(const TraceJob& job, int tile, TraceCounts* counts);
void TraceBlendedPackets(const TraceJob& job, int tile, TraceCounts* counts);
// The one for this job; null where there is none (summed and gated thresholds, which are there to
// reproduce the thesis, and blended ones with radii that need doubles).
TileTracer PacketTracerFor(const TraceJob& job);
// "AVX-512" and so on: what packets run on.
std::string PacketTargetName();

}  // namespace sherd
