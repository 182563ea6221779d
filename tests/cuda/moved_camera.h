// The cameras of a measured sequence of frames.
#pragma once

#include <cmath>

#include "metaball/camera.h"

namespace sherd {

// A camera near the scene's own: moved sideways by up to 2 % of its distance from the middle.
inline Camera MovedCamera(const Camera& camera, int frame) {
  Camera moved = camera;
  moved.eye = camera.eye + camera.right * (0.02 * std::sin(0.7 * frame)) +
              camera.down * (0.02 * std::cos(1.1 * frame));
  return moved;
}

}  // namespace sherd
