// The scenes on which every backend is compared with the double-precision reference, beside the
// stiff ones of datasets_synthetic/stiff_cases.h.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/scene.h"

namespace sherd {

struct CheckScene {
  std::string name;
  Scene scene;
  Camera camera;
  int supersample = 1;
  // Largest depth error allowed, in radii: 1e-4 by the contract, and what a float depth plane can
  // hold where the camera is far.
  double depth_tolerance = 1e-4;
  double normal_tolerance_deg = 0.1;
};

// count: metaballs of the two peer scenes; width x height: of most pictures. Deterministic.
std::vector<CheckScene> MakeCheckScenes(std::uint64_t count, int width, int height);

}  // namespace sherd
