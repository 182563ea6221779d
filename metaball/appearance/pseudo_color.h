// Quantities as colours (thesis 3.2-3.4): the value at a surface point and the range of the map.
#pragma once

#include <cstddef>
#include <string>

#include "metaball/appearance/appearance.h"
#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/frame.h"
#include "metaball/scene.h"

namespace sherd {

// The map in use.
const ColorMap& MapOf(const PseudoColor& pseudo);
// "distance from the camera", "channel error", ...: for people.
std::string TitleOf(const PseudoColor& pseudo);

// The range that the map spans: the one that is given, or
//   intensity    [0, T]. On the exact surface F = T, so the sum cannot exceed T; the thesis's
//                [T, 1] presumes points that lie behind the surface;
//   field        [T, 1], or [T, 2 T] for T >= 1;
//   Morton key   [0, 1];
//   others       the 2nd to the 98th percentile over the metaballs (at most 65 536 of them, evenly
//                taken), so that the range does not depend on the part of the picture that is drawn
//                and a few strays do not flatten it.
// Throws Error for a range that is empty, a channel or component that does not exist.
ColorRange RangeOf(const Scene& scene, const Camera& camera);

// The quantity prepared for one frame.
class PseudoColorPass {
 public:
  // The frame must hold the planes that the quantity needs (deferred.h).
  PseudoColorPass(const Scene& scene, const Camera& camera, const Frame& frame);

  // Linear light. point: the hit, world. normal: unit.
  Vec3f ColorAt(std::size_t pixel, const Vec3d& point, const Vec3f& normal) const;

 private:
  double ValueAt(std::size_t pixel, const Vec3d& point) const;

  const PseudoColor& pseudo_;
  const ColorMap& map_;
  const Frame& frame_;
  const ChannelPlane* plane_ = nullptr;
  ColorRange range_;
  Vec3d axis_, eye_;
  Vec3d cube_min_{};  // world
  double cube_side_ = 1;
};

}  // namespace sherd
