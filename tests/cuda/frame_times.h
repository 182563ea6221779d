// The time of frames and of the kernels in them.
#pragma once

#include <string>
#include <vector>

#include "bench_options.h"
#include "cuda/profiling.h"
#include "datasets_synthetic/peer_scenes.h"
#include "json_writer.h"

namespace sherd {

struct FrameTimes {
  double frame = 0;                 // milliseconds to the host's memory
  std::vector<KernelTime> kernels;  // a frame's launches of one name together, in their order
  RenderStats stats;                // of one of the frames

  // Milliseconds of all; NaN where they were not timed.
  double Kernels() const;
};

// Medians over options.frames frames, each with a camera of its own, after a warm-up: whole frames
// without the profile's events first, then kernels with them. A frame is handed back for the next.
// `profile` is asked for kernels: the renderer itself, or what it draws with.
FrameTimes TimeFrames(const PeerScene& peer, const RenderSettings& settings,
                      const BenchOptions& options, Renderer* renderer, ProfilingRenderer* profile);

// Of the last frame, launches of one name together.
std::vector<KernelTime> KernelsByName(const ProfilingRenderer& renderer);

// The fields "frame_milliseconds_to_host_memory", "kernels_milliseconds" (null where not timed) and
// "kernels" of an object that is being written.
void WriteTimes(const FrameTimes& times, JsonWriter* json);

// "frame 1.234 ms, kernels 1.000 ms: Trace 0.900 ..." on the line that is being printed, and its
// end.
void PrintTimes(const FrameTimes& times);

}  // namespace sherd
