// Pictures with an appearance beyond blended colours and one light: the planes a scene needs, and
// the passes over the finished frame. For any renderer that can fill the planes.
#pragma once

#include "metaball/frame.h"
#include "metaball/renderer.h"
#include "metaball/scene.h"

namespace sherd {

// Whether RenderDeferred must make these planes of this scene. A Renderer asks this first in its
// Render, before supersampling, and calls RenderDeferred with itself.
bool NeedsDeferredPasses(const Scene& scene, const Planes& wanted);

// `wanted` and what the passes read.
Planes PlanesNeeded(const Scene& scene, const Planes& wanted);

// Throws Error for an appearance that is out of range, or misses an image or a channel.
void CheckAppearance(const Scene& scene);

// Draws the scene: `renderer` is called with blended, unlit colours and the planes that are needed,
// then the passes colour, light and filter the picture. Frame::normal stays the field's own. The
// filter sees beyond the picture's border, so that parts of a picture fit together.
Frame RenderDeferred(Renderer* renderer, const Scene& scene, const Camera& camera,
                     const RenderSettings& settings, const Control& control);

}  // namespace sherd
