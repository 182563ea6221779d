// The one parallel loop: TBB where it is built in, std::thread otherwise.
#pragma once

#include <cstdint>
#include <functional>

namespace sherd {

// Threads a loop uses for `requested` (0: all the machine has); >= 1.
int ThreadCount(int requested);

// Calls body(i, worker) once for every i in [0, count), in any order, on at most `threads` threads
// (0: all); worker is in [0, ThreadCount(threads)) and no two calls with one worker run at once.
// The first exception a call throws ends the loop and is thrown again here.
void ParallelFor(std::int64_t count, int threads,
                 const std::function<void(std::int64_t i, int worker)>& body);

}  // namespace sherd
