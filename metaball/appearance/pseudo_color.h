// Quantities as colours (thesis 3.2-3.4): the value at a surface point and the range of the map.
#pragma once

#include <string>

#include "metaball/appearance/appearance.h"
#include "metaball/appearance/quantity_view.h"
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

// All but the planes, the map's table that of MapOf. Throws Error as RangeOf does, and for a
// channel or component that does not exist.
QuantityView MakeQuantityView(const Scene& scene, const Camera& camera);

// The same with the planes of a frame, which holds those that the quantity needs (deferred.h).
// Scene and frame must live on unchanged.
QuantityView QuantityOf(const Scene& scene, const Camera& camera, const Frame& frame);

}  // namespace sherd
