// Work on blocks of fixed size in parallel: which block holds what never depends on the number of
// threads, so results do not either. Internal to reconstruction/.
#pragma once

#include <cstddef>
#include <functional>

#include "metaball/control.h"

namespace sherd {

// Calls work(begin, end) for [0, n) cut into blocks of `block`; reports `what` from fraction
// `from` to `to`. The first exception is rethrown; Cancelled when asked to stop.
void ParallelBlocks(std::size_t n, std::size_t block,
                    const std::function<void(std::size_t begin, std::size_t end)>& work,
                    const Control& control = {}, const char* what = nullptr, double from = 0,
                    double to = 1);

}  // namespace sherd
