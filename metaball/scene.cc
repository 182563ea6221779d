#include "metaball/scene.h"

#include "metaball/error.h"

namespace sherd {

std::vector<std::string> ThresholdModeNames() { return {"uniform", "blended", "summed", "gated"}; }

std::string NameOf(ThresholdMode mode) {
  return ThresholdModeNames()[static_cast<std::size_t>(mode)];
}

ThresholdMode ParseThresholdMode(const std::string& name) {
  const std::vector<std::string> names = ThresholdModeNames();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return static_cast<ThresholdMode>(i);
  }
  throw InputError("", "", "there are no thresholds '" + name + "'",
                   "use uniform, blended, summed or gated");
}

Scene SceneOf(const CloudInput& input, double threshold) {
  Scene scene;
  scene.cloud = std::make_shared<Cloud>(BuildCloud(input));
  scene.surface.threshold = threshold;
  return scene;
}

}  // namespace sherd
