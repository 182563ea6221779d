// Stray points. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/control.h"
#include "reconstruction/neighbors.h"

namespace sherd {

inline constexpr int kOutlierNeighbors = 16;

// mean[i]: mean distance of point i to its kOutlierNeighbors nearest; spacing[i]: its local
// spacing. Three tests, each with PCL's k-d tree:
//
// 1. The statistic of pcl::StatisticalOutlierRemoval, the mean distance, but PCL compares with
//    mean + c * deviation over the whole cloud, which far strays inflate: here the logarithms are
//    compared, by their median and median deviation.
// 2. A cloud's density varies: a point is also a stray when its mean distance is far above that of
//    its own neighbours.
// 3. What floats in small clumps (a wrong depth takes its neighbours along) is near to itself but
// to
//    nothing else: points joined by steps of about the spacing make components, and components of
//    fewer than a two-thousandth of the points go.
std::vector<bool> FindOutliers(const NeighborSearch& search, const std::vector<float>& mean,
                               const std::vector<float>& spacing, const Control& control);

}  // namespace sherd
