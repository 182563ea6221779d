// How the surface looks beyond blended colours and one light: the options of metaball/appearance.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "metaball/scene.h"
#include "metaball/vec.h"
#include "reconstruction/level.h"

namespace sherd::cli {

struct AppearanceOptions {
  std::vector<Light> lights;
  std::string color_by, color_map = "viridis";
  std::optional<ColorRange> color_range;
  std::string texture, normal_map;  // files
  std::string projection = "planar", texture_mode = "surface", normals = "gradient";
  std::optional<Vec3d> projection_along, projection_up;
  bool texture_repeat = false, shadows = false, ambient_occlusion = false;
  std::optional<double> ao_directions, ao_distance, filter;

  // The one light that the scene's own lighting can be, or null: far away, white and fixed.
  const Light* OnlyDirection() const;
};

// "X,Y,Z" (towards a light far away), "sun:X,Y,Z", "point:X,Y,Z", "camera", "camera-sun:X,Y,Z",
// "camera-point:X,Y,Z" (in the camera's axes: right, down, forward), each with "@INTENSITY" or
// "@R,G,B" (linear light) after it. Throws InputError.
Light ParseLight(const std::string& text);
// "LO,HI". Throws InputError.
ColorRange ParseColorRange(const std::string& text);

// --light alone.
void AddLightOption(CLI::App* app, AppearanceOptions* options);
// All but --light.
void AddAppearanceOptions(CLI::App* app, AppearanceOptions* options);

// Puts what was asked for into the scene, whose cloud and surface are set. Reads the images; a
// cloud that needs further channels is copied, everything else is left as it is. level: where the
// cloud is one's, else null. up: the world's. Throws InputError for a file that cannot be read and
// a quantity that does not exist.
void ApplyAppearance(const AppearanceOptions& options, const Level* level, const Vec3d& up,
                     int threads, Scene* scene);

}  // namespace sherd::cli
