// Shadow rays with blended thresholds, in floats; the density is chosen at run time, as this is
// seldom asked for.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "metaball/appearance/occlusion_packets_blended.cc"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "metaball/appearance/occlusion_packets-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

void CastBlended(const OcclusionJob& job, const OcclusionRay* rays, int count, RayCounts* counts,
                 std::uint8_t* occluded) {
  CastPackets<ThresholdMode::kBlended, float>(job, AnyShape{job.shape}, rays, count, counts,
                                              occluded);
}

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sherd {

HWY_EXPORT(CastBlended);

void CastBlendedPackets(const OcclusionJob& job, const OcclusionRay* rays, int count,
                        RayCounts* counts, std::uint8_t* occluded) {
  HWY_DYNAMIC_DISPATCH(CastBlended)(job, rays, count, counts, occluded);
}

}  // namespace sherd
#endif  // HWY_ONCE
