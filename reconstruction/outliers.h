// Stray points. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/control.h"
#include "reconstruction/level.h"
#include "reconstruction/neighbors.h"

namespace sherd {

inline constexpr int kOutlierNeighbors = 16;

// Takes out the points that are marked, counting them as outliers; what is known of each of the
// others stays with it. Before OrderPoints.
void RemoveStray(const std::vector<char>& stray, PreparedPoints* prepared);

// Each marks what it finds with 1 in `stray` and takes points that are marked already for gone.

// By the statistic of pcl::StatisticalOutlierRemoval, the mean distance to the kOutlierNeighbors
// nearest, with two changes. PCL compares with mean + c * deviation over the whole
// cloud, which far strays inflate: here the logarithms are compared, by their median and median
// deviation. And a cloud's density varies. So a point far above the cloud's median is a stray only
// where its neighbours fill space: a coarse part of a survey still lies on a surface. And a point
// far above its own neighbours is one wherever it is. mean: of each point.
void FindSparse(const NeighborSearch& search, const std::vector<Vec3d>& positions,
                const std::vector<float>& mean, std::vector<char>* stray, const Control& control);

// What floats in small clumps (a wrong depth takes its neighbours along) is near to itself but to
// nothing else: points joined by steps of about the spacing make components, and components of
// fewer than a two-thousandth of the points go. spacing: local, of each point.
void FindClumps(const NeighborSearch& search, const std::vector<float>& spacing,
                std::vector<char>* stray, const Control& control);

}  // namespace sherd
