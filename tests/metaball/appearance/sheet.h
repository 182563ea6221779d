// What the tests of the appearance share: the thesis's sheets, seen from above.
#pragma once

#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/renderer.h"

namespace sherd::testing {

inline RenderSettings WithPlanes() {
  RenderSettings settings;
  settings.planes = {.depth = true, .normal = true};
  return settings;
}

// A sheet of n x n metaballs over the unit square, spacing 1/n, radius and threshold as in the
// thesis's figures: 1.5 spacings, 0.01.
inline CloudInput Sheet(int n) {
  CloudInput input;
  input.uniform_radius = 1.5 / n;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) input.center.push_back({(i + 0.5) / n, (j + 0.5) / n, 0});
  }
  return input;
}

// Looks down on [x0, x0 + width] x [y0, y0 + width] with up = +y.
inline Camera DownOn(double x0, double y0, double width, int pixels) {
  const Vec3d middle{x0 + 0.5 * width, y0 + 0.5 * width, 0};
  return Camera::LookAtOrthographic(middle + Vec3d{0, 0, 1}, middle, {0, 1, 0}, width, pixels,
                                    pixels);
}

}  // namespace sherd::testing
