#include "reconstruction/parallel.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <mutex>

namespace sherd {

void ParallelBlocks(std::size_t n, std::size_t block,
                    const std::function<void(std::size_t begin, std::size_t end)>& work,
                    const Control& control, const char* what, double from, double to) {
  if (n == 0) return;
  const std::size_t blocks = (n + block - 1) / block;
  std::atomic<std::size_t> done{0};
  std::mutex reporting;
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, blocks, 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          control.ThrowIfStopped();
          work(i * block, std::min(n, (i + 1) * block));
          const std::size_t finished = ++done;
          // Whoever finds another thread reporting leaves it to that one.
          if (what && reporting.try_lock()) {
            const std::lock_guard<std::mutex> lock(reporting, std::adopt_lock);
            control.Report(what, from + (to - from) * static_cast<double>(finished) /
                                            static_cast<double>(blocks));
          }
        }
      },
      tbb::simple_partitioner());
}

}  // namespace sherd
