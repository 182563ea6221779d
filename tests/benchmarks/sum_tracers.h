// The packet tracer with other ways to sum up the field, for sum_benchmark.cc alone.
#pragma once

#include "metaball/trace_job.h"

namespace sherd {

enum class Sums {
  kPlain,        // floats, as the engine's default
  kCompensated,  // floats, every sum with what its additions have lost (Knuth's two-sum)
  kDouble,       // doubles throughout, as the engine does where floats do not do
};

// Draws one tile of a job with one threshold: Murakami's density or a
// cosine, radii of each metaball.
void TraceWithSums(const TraceJob& job, Sums sums, int tile, TraceCounts* counts);

}  // namespace sherd
