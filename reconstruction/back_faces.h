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

  // False for a pixel that shows a front, or where nothing around it does.
  bool Contains(std::size_t pixel) const { return !depth_.empty() && depth_[pixel] > 0; }
  // Of a pixel that is contained; world units along its ray, unit normal.
  double Depth(std::size_t pixel) const { return depth_[pixel]; }
  const Vec3f& Normal(std::size_t pixel) const { return normal_[pixel]; }

 private:
  // By pixel; empty where the whole picture shows fronts. Depth 0 where a pixel is not contained.
  std::vector<float> depth_;
  std::vector<Vec3f> normal_;
};

}  // namespace sherd
