// What a legend of a coloured picture shows, as data: the program draws it.
#pragma once

#include <string>
#include <vector>

#include "metaball/appearance/appearance.h"
#include "metaball/camera.h"
#include "metaball/color.h"
#include "metaball/scene.h"

namespace sherd {

struct LegendTick {
  double position = 0;  // along the bar, 0 at its low end, 1 at its high end
  double value = 0;
  std::string label;
};

struct Legend {
  std::string title;  // what is shown, e.g. "distance from the camera"
  ColorRange range;
  std::vector<Rgb8> colors;  // of the bar from its low end, even steps
  std::vector<LegendTick> ticks;
};

// The legend of a scene coloured by a quantity, with about `max_ticks` (2..20) round values; every
// value in the legend's range. camera: of the picture, where the range depends on it. Throws Error
// for a scene that is not coloured by a quantity, and for one coloured by normals, which no bar
// shows.
Legend MakeLegend(const Scene& scene, const Camera& camera, int max_ticks = 6);

// Values that are 1, 2 or 5 times a power of ten apart, in [lo, hi], at most max_ticks (>= 2), and
// how many decimals tell them apart.
std::vector<double> RoundTicks(double lo, double hi, int max_ticks, int* decimals);

}  // namespace sherd
