// A scale bar of a round length.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/frame.h"

namespace sherd {

struct ScaleBar {
  double metres = 0;     // 1, 2 or 5 times a power of ten
  double length_px = 0;  // on the picture, not rounded
  int segments = 0;      // black and white in turn
  std::string unit;      // "mm", "cm", "m", "km": of the labels
  double label_end = 0;  // the length in that unit
};

// The longest bar of a round length that is at most max_px long, where one world unit is
// `metres_per_unit` and a pixel is camera.PixelSizeAt(depth) (orthographic: `depth` is not used).
// nullopt where nothing sensible comes out (a depth that is not positive).
std::optional<ScaleBar> MakeScaleBar(const Camera& camera, double depth, double metres_per_unit,
                                     double max_px);

// The distance along the camera's axis of the surface nearest to the middle of the picture: the
// median over the hits in a window that grows until it holds some. nullopt without any hit.
std::optional<double> DepthAtCenter(const Camera& camera, const Frame& frame);

}  // namespace sherd
