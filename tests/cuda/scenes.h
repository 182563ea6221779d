// The scenes on which every backend is compared with the double-precision reference, beside the
// stiff ones of datasets_synthetic/stiff_cases.h.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/frame_difference.h"
#include "metaball/scene.h"

namespace sherd {

// What each metaball of MakeBall has of its own.
enum BallChannels { kOwnRadius = 1, kOwnColor = 2, kOwnThreshold = 4 };

// Metaballs in a ball of radius 1. Radii of their own are spread geometrically over
// [radius / spread, radius], thresholds evenly over 0.6 to 1.4 times the given one.
CloudInput MakeBall(int count, double radius, double spread, int channels, std::uint64_t seed,
                    double threshold = 0.7);

struct CheckScene {
  std::string name;
  Scene scene;
  Camera camera;
  int supersample = 1;
  // Largest depth error allowed, in radii: 1e-4 by the contract, and what a float depth plane can
  // hold where the camera is far.
  double depth_tolerance = 1e-4;
  double normal_tolerance_deg = 0.1;
  // Where the density ends with a slope, rounding says on which side of a rim a hit lies: normals
  // and a thousandth of the colours may be off there.
  bool creased = false;
  // Where thresholds are summed the field jumps at rims, and whole surfaces are rims: colours may
  // be off anywhere, a hundredth of the depths too where one is passed for less than the tolerance.
  bool jumps = false;
};

// What a frame may be off by; empty where it keeps to that, else one line.
std::string WhyOff(const CheckScene& scene, const Frame& frame, const FrameDifference& difference);

// count: metaballs of the two peer scenes; width x height: of most pictures. Deterministic.
std::vector<CheckScene> MakeCheckScenes(std::uint64_t count, int width, int height);

}  // namespace sherd
