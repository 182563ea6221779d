// One threshold, in doubles, for radii that floats cannot carry.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "metaball/packet_tracer_double.cc"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "metaball/packet_tracer-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

void TraceUniformDouble(const TraceJob& job, int tile, TraceCounts* counts) {
  TraceTilePackets<ThresholdMode::kUniform, double>(job, tile, counts);
}

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sherd {

HWY_EXPORT(TraceUniformDouble);

void TraceUniformDoublePackets(const TraceJob& job, int tile, TraceCounts* counts) {
  HWY_DYNAMIC_DISPATCH(TraceUniformDouble)(job, tile, counts);
}

}  // namespace sherd
#endif  // HWY_ONCE
