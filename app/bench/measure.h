// What one contender costs and how wrong it is.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/bench/contenders.h"
#include "metaball/camera.h"
#include "metaball/control.h"
#include "metaball/frame_difference.h"
#include "metaball/reference/reference.h"

namespace sherd {

// CPU seconds of the whole process, user and system.
double ProcessCpuSeconds();

// Seconds of one frame: the medians over the repetitions, and the fastest.
struct FrameTime {
  double wall = 0, wall_min = 0;
  double cpu = 0;  // of all threads together
};

// Draws the frame once unmeasured, then `repeat` times (>= 1). last, if given, receives the last
// frame. Throws what the renderer throws.
FrameTime TimeFrame(Renderer* renderer, const Scene& scene, const Camera& camera,
                    const RenderSettings& settings, int repeat, const Control& control,
                    Frame* last = nullptr);

struct Measurement {
  std::string method, series, parameter, precision, backend;
  std::string error;  // why the scene could not be drawn; the figures below then mean nothing
  std::string device;
  FrameTime seconds;
  double rays_per_second = 0;
  std::uint64_t bytes = 0;  // RenderStats::bytes
  std::uint64_t grazing = 0, unresolved = 0;
  FrameDifference difference;

  bool drawn() const { return error.empty(); }
};

// Throws Cancelled; any other Error of the renderer becomes Measurement::error. The frame is drawn
// with depth and normals.
Measurement Measure(const Contender& contender, const Scene& scene, const Camera& camera,
                    const ReferenceFrame& reference, int threads, int repeat,
                    const Control& control);

}  // namespace sherd
