// Odds and ends of a frame that the methods share.
#pragma once

#include <chrono>

#include "metaball/frame.h"
#include "metaball/trace_job.h"

namespace sherd {

class Stopwatch {
 public:
  double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

inline void AddCounts(const TraceCounts& counts, RenderStats* stats) {
  stats->hits += counts.hits;
  stats->rays_started_inside += counts.rays.started_inside;
  stats->grazing += counts.rays.grazing;
  stats->unresolved += counts.rays.unresolved;
}

}  // namespace sherd
