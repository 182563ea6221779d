// Evenly spaced samples of a surface: blue noise. Internal to reconstruction/.
//
// Weighted sample elimination (Yuksel, "Sample elimination for generating Poisson disk sample
// sets", Computer Graphics Forum 34, 2015): the sample that is most crowded goes, again and again,
// until as many are left as are wanted. A sample i is crowded by its neighbours j at distances d by
// sum_j (1 - max(d, d_min) / (2 d_max))^8, d < 2 d_max, d_max = sqrt(area / (2 sqrt(3) target)),
// the spacing of the closest packing.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/control.h"
#include "metaball/vec.h"

namespace sherd {

struct Samples {
  std::vector<Vec3d> position;  // world units
  std::vector<double> area;     // of the surface that each stands for
  // The spacing wanted at each, relative to the others; or empty: the same everywhere.
  std::vector<float> stretch;
};

// The indices of the `target` samples that stay, ascending. One thread removes; deterministic.
// target <= samples. Throws Cancelled.
std::vector<std::uint32_t> EliminateSamples(const Samples& samples, std::uint64_t target,
                                            const Control& control = {});

// All samples in an order in which the first N are evenly spaced for every N: elimination from all
// to half of them, to a quarter and so on, what goes first standing last.
std::vector<std::uint32_t> EliminationOrder(const Samples& samples, const Control& control = {});

}  // namespace sherd
