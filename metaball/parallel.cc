#include "metaball/parallel.h"

#include <algorithm>
#include <thread>

#ifdef SHERD_HAVE_TBB
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#else
#include <atomic>
#include <exception>
#include <mutex>
#include <vector>
#endif

namespace sherd {

int ThreadCount(int requested) {
  if (requested > 0) return requested;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

#ifdef SHERD_HAVE_TBB

void ParallelFor(std::int64_t count, int threads,
                 const std::function<void(std::int64_t, int)>& body) {
  if (count <= 0) return;
  // More threads than the machine has would only make TBB complain.
  tbb::task_arena arena(std::min(ThreadCount(threads), tbb::info::default_concurrency()));
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::int64_t>(0, count, 1),
        [&](const tbb::blocked_range<std::int64_t>& range) {
          const int worker = tbb::this_task_arena::current_thread_index();
          for (std::int64_t i = range.begin(); i < range.end(); ++i) body(i, worker);
        },
        tbb::auto_partitioner());
  });
}

#else

void ParallelFor(std::int64_t count, int threads,
                 const std::function<void(std::int64_t, int)>& body) {
  if (count <= 0) return;
  const int workers = static_cast<int>(std::min<std::int64_t>(ThreadCount(threads), count));
  std::atomic<std::int64_t> next{0};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto work = [&](int worker) {
    try {
      for (std::int64_t i = next++; i < count; i = next++) body(i, worker);
    } catch (...) {
      next = count;
      const std::lock_guard lock(error_mutex);
      if (!error) error = std::current_exception();
    }
  };
  std::vector<std::jthread> pool;
  for (int w = 1; w < workers; ++w) pool.emplace_back(work, w);
  work(0);
  pool.clear();  // joins
  if (error) std::rethrow_exception(error);
}

#endif

}  // namespace sherd
