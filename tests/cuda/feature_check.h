// Every feature of a scene, drawn by a backend, against the CPU renderer.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "appearance_scenes.h"
#include "json_writer.h"
#include "metaball/renderer.h"
#include "picture_difference.h"

namespace sherd {

struct FeatureCheck {
  std::string name, backend;
  int supersample = 1;
  PictureDifference difference;
  // Pixels that may be off: in colour, in the planes (at another place or of another value), in the
  // metaballs' ids.
  std::uint64_t allowed = 0, planes_allowed = 0, ids_allowed = 0;
  double seconds = 0;  // of the frame
  bool passed = false;
  std::string error;
};

RenderSettings SettingsOf(const FeatureScene& feature, int supersample);

// Holds what `draw` returns, or throws, against the CPU's picture. The caller names backend and
// check; further faults go to `error` and clear `passed`.
FeatureCheck JudgeFeature(const FeatureScene& feature, int supersample, const Frame& cpu,
                          const std::function<Frame()>& draw);

// The feature at 1 and at 2 x 2 samples a pixel on each backend, each time by a new renderer.
std::vector<FeatureCheck> CheckFeature(const FeatureScene& feature,
                                       const std::vector<std::string>& backends);

void Print(const FeatureCheck& check);
void Write(const FeatureCheck& check, JsonWriter* json);

}  // namespace sherd
