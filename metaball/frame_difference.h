// How far a rendered frame is from the reference.
#pragma once

#include <cstdint>
#include <string>

#include "metaball/frame.h"
#include "metaball/reference/reference.h"

namespace sherd {

// Pixels the reference calls grazing are left out of `missed`, `invented`, `color_off` and the
// depth figures, and counted on their own.
struct FrameDifference {
  std::uint64_t pixels = 0, grazing = 0;
  std::uint64_t missed = 0;     // the reference hits, the frame does not
  std::uint64_t invented = 0;   // the frame hits, the reference does not
  std::uint64_t color_off = 0;  // hit by both, off by more than 8/255 (linear) in a channel
  // |depth - reference| over the smallest radius at the hit; when the frame has a depth plane. Half
  // a step of the plane's floats is allowed for: it is the plane's, not the intersector's.
  double depth_median = 0, depth_p99 = 0, depth_max = 0;
  double normal_max_deg = 0;  // largest angle; when the frame has a normal plane
  double color_max = 0;       // largest difference of a channel, linear

  // For test messages.
  std::string Describe() const;
};

// unit: the cloud's frame.unit, which turns local depths into the frame's world depths.
FrameDifference CompareToReference(const Frame& frame, const ReferenceFrame& reference,
                                   double unit);

}  // namespace sherd
