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
  // Angle between the normals; when the frame has a normal plane.
  double normal_median_deg = 0, normal_p99_deg = 0, normal_max_deg = 0;
  double color_max = 0;  // largest difference of a channel, linear
  // Colour difference of the pixels that both hit (DeltaE76).
  double delta_e_median = 0, delta_e_p99 = 0, delta_e_max = 0;

  // Missed, invented or off in colour, over the pixels that are not grazing; 0 where all are.
  double WrongShare() const;
  // For test messages.
  std::string Describe() const;
};

// The distance of two colours, linear sRGB, in CIE 1976 L*a*b* with the white point D65:
//   (X, Y, Z) = M (r, g, b), M of IEC 61966-2-1; (Xn, Yn, Zn) = M (1, 1, 1)
//   f(t) = cbrt(t) where t > (6/29)^3, else t / (3 (6/29)^2) + 4/29
//   L = 116 f(Y/Yn) - 16, a = 500 (f(X/Xn) - f(Y/Yn)), b = 200 (f(Y/Yn) - f(Z/Zn))
//   dE = sqrt(dL^2 + da^2 + db^2)
// About 2.3 is what an eye just notices.
double DeltaE76(const Vec3d& linear_a, const Vec3d& linear_b);

// unit: the cloud's frame.unit, which turns local depths into the frame's world depths.
FrameDifference CompareToReference(const Frame& frame, const ReferenceFrame& reference,
                                   double unit);

}  // namespace sherd
