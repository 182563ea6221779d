// Any renderer, drawing a coarser cloud where metaballs are smaller than a pixel.
#pragma once

#include <memory>

#include "metaball/renderer.h"

namespace sherd {

// Draws each frame from the coarsest level of detail whose error (level_of_detail.h) is less than
// `pixels` of one of its pixels, and by `inner` exactly as it would alone where there is none.
// RenderStats::lod_* say what was drawn, its error, and why there was none. The id plane names
// metaballs of the full cloud. Levels are kept from frame to frame while cloud, threshold, density
// and radius factor stay; the parts of a picture rendered one after another may be drawn from
// different levels, each within `pixels`.
//
// Not used for what hangs on the single metaballs: the planes weight, intensity, influence and uv,
// and an appearance that needs passes of its own. Throws Error for `pixels` not positive.
std::unique_ptr<Renderer> MakeLodRenderer(std::unique_ptr<Renderer> inner, double pixels = 0.5);

}  // namespace sherd
