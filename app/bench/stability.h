// The stiff and extreme cases (datasets_synthetic/stiff_cases.h) on every backend.
#pragma once

#include <string>
#include <vector>

#include "app/bench/figure_table.h"
#include "cuda/device_choice.h"
#include "metaball/control.h"
#include "metaball/frame_difference.h"

namespace sherd {

struct StabilityRow {
  std::string name, expects;  // the case, and what must come out
  std::string backend;        // "cpu, vectors", "cpu, scalar", "cuda"
  // "passed", "failed", or "refused" where this backend says that it cannot draw the case.
  std::string outcome;
  std::string what;  // what came out
  FrameDifference error;
  RenderStats stats;
};

// On the CPU and on MakeGpuRenderer's (contenders.h). Throws Cancelled, between two cases.
std::vector<StabilityRow> RunStability(const DeviceChoice& gpu, const Control& control);
FigureTable FiguresOf(const std::vector<StabilityRow>& rows);
// For a screen; the first row are the names of the columns.
std::vector<std::vector<std::string>> ScreenTable(const std::vector<StabilityRow>& rows);

}  // namespace sherd
