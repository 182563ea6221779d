// One threshold, in floats: what most scenes use.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "metaball/packet_tracer.cc"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "metaball/packet_tracer-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

void TraceUniform(const TraceJob& job, int tile, TraceCounts* counts) {
  TraceTilePackets<ThresholdMode::kUniform, float>(job, tile, counts);
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sherd {

HWY_EXPORT(TraceUniform);
HWY_EXPORT(TargetName);

void TraceUniformPackets(const TraceJob& job, int tile, TraceCounts* counts) {
  HWY_DYNAMIC_DISPATCH(TraceUniform)(job, tile, counts);
}

TileTracer PacketTracerFor(const TraceJob& job) {
  if (job.mode == ThresholdMode::kUniform) {
    return job.double_precision ? &TraceUniformDoublePackets : &TraceUniformPackets;
  }
  if (job.mode == ThresholdMode::kBlended && !job.double_precision) return &TraceBlendedPackets;
  return nullptr;
}

std::string PacketTargetName() {
  const std::string target = HWY_DYNAMIC_DISPATCH(TargetName)();
  return target.starts_with("AVX3") ? "AVX-512" : target;  // Highway's name for it
}

}  // namespace sherd
#endif  // HWY_ONCE
