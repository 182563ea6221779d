// What nothing else beats in both of two costs.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace sherd {

struct CostPair {
  double time = 0, error = 0;  // both finite, less is better
};

// The indices of the points that no other point beats: none is as good in both and better in one.
// By rising time, so that the errors fall; of equal points the first alone.
std::vector<std::size_t> ParetoFront(std::span<const CostPair> points);

}  // namespace sherd
