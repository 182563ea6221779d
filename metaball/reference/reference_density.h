// The densities of the thesis in double precision, as it prints them, and their ranges over an
// interval: what the reference sums. Written apart from the engine's shapes, so that each checks
// the other.
#pragma once

#include <vector>

#include "metaball/density/model.h"

namespace sherd {

struct Interval {
  double lo = 0.0, hi = 0.0;
};

// A function of x = distance / radius, 0 from support() on.
class ReferenceDensity {
 public:
  // Throws Error for a parameter out of range.
  explicit ReferenceDensity(const DensityModel& model);

  double support() const { return support_; }
  double Value(double x) const;
  double Slope(double x) const;  // d/dx
  // Over [x0, x1], the part beyond the support left out.
  Interval ValueRange(double x0, double x1) const;
  Interval SlopeRange(double x0, double x1) const;

 private:
  DensityModel model_;
  double support_ = 1.0;
  std::vector<double> value_turns_, slope_turns_;  // where Value and Slope have their extremes
};

}  // namespace sherd
