// Shadow rays with one threshold, in floats: what most scenes use.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "metaball/appearance/occlusion_packets.cc"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "metaball/appearance/occlusion_packets-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

void CastUniform(const OcclusionJob& job, const OcclusionRay* rays, int count, RayCounts* counts,
                 std::uint8_t* occluded) {
  // Qualified: the argument would find the scalar one as well.
  HWY_NAMESPACE::WithShape(job.shape, [&](const auto& shape) HWY_ATTR {
    CastPackets<ThresholdMode::kUniform, float>(job, shape, rays, count, counts, occluded);
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sherd {

HWY_EXPORT(CastUniform);

void CastUniformPackets(const OcclusionJob& job, const OcclusionRay* rays, int count,
                        RayCounts* counts, std::uint8_t* occluded) {
  HWY_DYNAMIC_DISPATCH(CastUniform)(job, rays, count, counts, occluded);
}

OcclusionCaster PacketCasterFor(const OcclusionJob& job) {
  if (job.mode == ThresholdMode::kUniform) {
    return job.double_precision ? &CastUniformDoublePackets : &CastUniformPackets;
  }
  if (job.mode == ThresholdMode::kBlended && !job.double_precision) return &CastBlendedPackets;
  return nullptr;
}

}  // namespace sherd
#endif  // HWY_ONCE
