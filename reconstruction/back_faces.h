// Pixels that show the surface from its back: through a hole into the inside, or a lone metaball
// whose normal is wrong. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/camera.h"
#include "metaball/frame.h"
#include "metaball/vec.h"
#include "reconstruction/level.h"
#include "reconstruction/surface_point.h"

namespace sherd {

// Where the surface would be that such pixels should have shown: depth and normal of the pixels
// around that show a front, carried across by the pull-push of Gortler, Grzeszczuk, Szeliski and
// Cohen (1996, section 3.4.2).
class BackFaces {
 public:
  // frame: with depth, normal and id planes, of the level and camera.
  BackFaces(const Level& level, const SurfaceSampler& sampler, const Camera& camera,
            const Frame& frame);

  struct Pixel {
    std::uint32_t pixel = 0;  // into the frame
    float depth = 0;          // world units along its ray
    Vec3f normal{};           // unit
  };
  // Null for a pixel that shows a front, or where nothing around it does.
  const Pixel* Find(std::size_t pixel) const;

 private:
  std::vector<Pixel> pixels_;  // in ascending order
};

}  // namespace sherd
