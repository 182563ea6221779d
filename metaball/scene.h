// What is drawn: a cloud, the surface taken from its field, and how it is lit.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "metaball/appearance/appearance.h"
#include "metaball/cloud.h"
#include "metaball/density/model.h"
#include "metaball/vec.h"

namespace sherd {

// How the metaballs' thresholds make one surface. T_k is Cloud::threshold, or Surface::threshold
// for all; f_k the density at a point p. Inside is where at least one support holds p and
enum class ThresholdMode {
  kUniform,  // sum f_k >= T: one T for all (thesis 2.8); Cloud::threshold is not used
  kBlended,  // sum f_k >= (sum f_k T_k) / (sum f_k): smooth; equal to kUniform when all T_k are
             // equal
  kSummed,   // sum (f_k - T_k) >= 0 over the supports that hold p (thesis 2.9, literally)
  kGated,    // some f_k >= T_k: a union of spheres (thesis algorithms 2-6, literally)
};

// "uniform", "blended", "summed", "gated". Parse throws InputError for another word.
std::string NameOf(ThresholdMode mode);
ThresholdMode ParseThresholdMode(const std::string& name);
std::vector<std::string> ThresholdModeNames();

struct Surface {
  double threshold = 0.7;     // > 0; at or above the highest field nothing is drawn
  double radius_scale = 1.0;  // > 0; multiplies every radius
  DensityModel density;
  ThresholdMode mode = ThresholdMode::kUniform;
  friend bool operator==(const Surface&, const Surface&) = default;
};

// thesis 3.7: min(1, C * ambient + C * diffuse * max(0, n . l)).
struct Lighting {
  bool unlit = false;             // the blended colour itself
  double ambient = 0.35;          // >= 0
  double diffuse = 0.65;          // >= 0
  bool headlight = true;          // the light comes from the camera; to_light is not used
  Vec3d to_light{-0.5, 1, -0.6};  // towards the light, any length > 0
};

struct Scene {
  std::shared_ptr<const Cloud> cloud;
  Surface surface;
  Lighting lighting;
  Appearance appearance;
};

// These metaballs with one threshold, all else as it is where nothing is asked for. Throws as
// BuildCloud does.
Scene SceneOf(const CloudInput& input, double threshold = 0.7);

}  // namespace sherd
