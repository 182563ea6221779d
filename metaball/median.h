// The median of unsorted values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sherd {

// The upper one of an even number of values; 0 of none. No value may be NaN.
template <class T>
T Median(std::vector<T> values) {
  if (values.empty()) return T(0);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace sherd
