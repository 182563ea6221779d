// What a scene can ask for beyond metaballs of one radius and colour, each kind of it once: the
// scenes on which every backend is compared with the CPU renderer, which has tests of its own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "metaball/appearance/image.h"
#include "metaball/camera.h"
#include "metaball/frame.h"
#include "metaball/scene.h"

namespace sherd {

struct FeatureScene {
  std::string name;
  Scene scene;
  Camera camera;
  Planes planes;
  // Share of the pixels whose colour may be another than the CPU's: rims, and borders of shadows,
  // where a ray that only just meets something decides.
  double colors_off = 0.002;
  // World units. Where two renderers stop farther apart they stopped at different metaballs' rims,
  // and nothing else need be the same; that is allowed on a 500th of the pixels.
  double depth_tolerance = 2e-5;
};

// An image of 37 x 22 pixels with a ramp along either side.
std::shared_ptr<const ImagePyramid> MakeRampImage(ImageEncoding encoding);

// The appearances (metaball/appearance/appearance.h), of a bumpy sheet with a ball above it. No
// planes are asked for. Deterministic.
std::vector<FeatureScene> MakeAppearanceScenes(int width = 84, int height = 60);

// Metaballs on a sphere of radius 1 with a threshold of their own, a channel of every type
// ("height", "pair", "four", "direction") and coordinates around the sphere ("uv", periodic, with
// gradients). Radii are spread geometrically over [radius / spread, radius]; spread 1: one radius.
std::shared_ptr<Cloud> MakeChannelCloud(double radius, double spread);
// All that a frame can hold, of MakeChannelCloud's cloud.
Planes EveryPlane();
// Every plane under every mode of thresholds, in floats and in doubles. Deterministic.
std::vector<FeatureScene> MakePlaneScenes(int width = 90, int height = 70);

}  // namespace sherd
