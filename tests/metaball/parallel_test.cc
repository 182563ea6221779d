#include "metaball/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace sherd {
namespace {

TEST(ParallelFor, VisitsEveryIndexOnceOnTheWorkersItNames) {
  for (const int threads : {1, 2, 5}) {
    std::vector<std::atomic<int>> visits(10000);
    std::vector<std::atomic<int>> busy(threads);
    ParallelFor(10000, threads, [&](std::int64_t i, int worker) {
      ASSERT_GE(worker, 0);
      ASSERT_LT(worker, threads);
      EXPECT_EQ(busy[worker]++, 0);
      ++visits[i];
      --busy[worker];
    });
    for (const auto& v : visits) ASSERT_EQ(v, 1);
  }
}

TEST(ParallelFor, PassesOnAnException) {
  EXPECT_THROW(ParallelFor(1000, 2,
                           [](std::int64_t i, int) {
                             if (i == 77) throw std::runtime_error("seventy-seven");
                           }),
               std::runtime_error);
  ParallelFor(0, 2, [](std::int64_t, int) { FAIL(); });
}

}  // namespace
}  // namespace sherd
