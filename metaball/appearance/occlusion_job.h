// What the casters of shadow rays are given.
#pragma once

#include <cstdint>

#include "metaball/appearance/occlusion_rays.h"
#include "metaball/appearance/support_tree_view.h"
#include "metaball/density/model.h"
#include "metaball/scene.h"
#include "metaball/tile_march.h"
#include "metaball/vec.h"

namespace sherd {

struct OcclusionJob {
  SupportTreeView tree;
  TileList list;  // the whole cloud by index; no order and no fronts
  DensityShape shape;
  ThresholdMode mode = ThresholdMode::kUniform;
  bool double_precision = false;  // floats cannot carry the scene (precision.h)
};

using OcclusionCaster = void (*)(const OcclusionJob& job, const OcclusionRay* rays, int count,
                                 RayCounts* counts, std::uint8_t* occluded);

// tree.BeamAlong, compiled apart from the casters: with the vectors' instructions sums and products
// would be rounded together, and beams would differ from machine to machine.
Beam BeamThrough(const SupportTreeView& tree, const Vec3d& origin, const Vec3d& direction,
                 double spread, double begin, double end);

// In packets of rays with the widest vectors this machine has (occlusion_packets-inl.h); not in the
// core build, which is without Highway.
void CastUniformPackets(const OcclusionJob& job, const OcclusionRay* rays, int count,
                        RayCounts* counts, std::uint8_t* occluded);
void CastUniformDoublePackets(const OcclusionJob& job, const OcclusionRay* rays, int count,
                              RayCounts* counts, std::uint8_t* occluded);
void CastBlendedPackets(const OcclusionJob& job, const OcclusionRay* rays, int count,
                        RayCounts* counts, std::uint8_t* occluded);
// The one for this job; null where there is none, as for PacketTracerFor (trace_job.h).
OcclusionCaster PacketCasterFor(const OcclusionJob& job);

}  // namespace sherd
