// POV-Ray (povray.org) as a rival: the same scene written in its language, its own figures read
// back.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "datasets_synthetic/peer_scenes.h"

namespace sherd {

struct PovRayRun {
  double seconds_parse = 0;  // POV-Ray's own figures, wall clock
  double seconds_trace = 0;
  double seconds_wall = 0;  // the whole process
  double peak_mb = 0;       // resident, of the process
  int width = 0, height = 0;
  std::vector<unsigned char> rgb;  // linear 8-bit, row-major
};

// Renders with the `povray` found in PATH in a temporary folder; nullopt (and a line on stderr)
// when there is none or it fails.
std::optional<PovRayRun> RenderWithPovRay(const PeerScene& peer, int threads);

}  // namespace sherd
