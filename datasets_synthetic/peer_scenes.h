// The two scenes every renderer can draw: a height field and a shell (docs/performance.md).
#pragma once

#include <cstdint>

#include "metaball/camera.h"
#include "metaball/scene.h"

namespace sherd {

struct PeerScene {
  Scene scene;  // Murakami, threshold 0.7, ambient 0.2, diffuse 0.8, light (-0.5, 1, -0.6)
  Camera camera;
};

// n x n metaballs, n = round(sqrt(count)), on [0, 1]^2 with jitter.
PeerScene MakeHeightField(std::uint64_t count, int width = 1280, int height = 720,
                          std::uint32_t seed = 1);
// A Fibonacci sphere of radius 0.5 with radial jitter.
PeerScene MakeShell(std::uint64_t count, int width = 1280, int height = 720,
                    std::uint32_t seed = 1);

// Gives every metaball a threshold of its own, from threshold * (1 - spread) to threshold * (1 +
// spread), without order in space but the same in every run. 0 <= spread < 1.
void SpreadThresholds(double threshold, double spread, Cloud* cloud);

}  // namespace sherd
