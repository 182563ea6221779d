// Blended thresholds, in floats.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "metaball/packet_tracer_blended.cc"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "metaball/packet_tracer-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

void TraceBlended(const TraceJob& job, int tile, TraceCounts* counts) {
  TraceTilePackets<ThresholdMode::kBlended, float>(job, tile, counts);
}

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sherd {

HWY_EXPORT(TraceBlended);

void TraceBlendedPackets(const TraceJob& job, int tile, TraceCounts* counts) {
  HWY_DYNAMIC_DISPATCH(TraceBlended)(job, tile, counts);
}

}  // namespace sherd
#endif  // HWY_ONCE
