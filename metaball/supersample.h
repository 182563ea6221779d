// What every backend does the same way around its own work: checks, an empty frame, supersampling.
#pragma once

#include "metaball/renderer.h"

namespace sherd {

// Throws Error for a missing cloud, a camera or a surface out of range, ResourceError for a picture
// whose planes cannot be addressed.
void CheckRenderInput(const Scene& scene, const Camera& camera, const RenderSettings& settings);

// Whether the planes of a new frame are background, or hold anything as every pixel will be
// written.
enum class FrameContent { kBackground, kAnything };

// A frame of the camera's size with the planes of Planes's first row (NeedGather's are
// SurfaceGather's to add), in the memory of `spare` where that suffices. Throws ResourceError when
// there is no memory.
Frame MakeFrame(const Camera& camera, const Planes& planes, Frame spare = {},
                FrameContent content = FrameContent::kBackground);

// n x n rays a pixel: renders the picture n times as large in bands by `renderer`, which is called
// with supersample = 1, and averages in linear light. Planes take the sample nearest the centre.
Frame RenderSupersampled(Renderer* renderer, const Scene& scene, const Camera& camera,
                         const RenderSettings& settings, const Control& control);

}  // namespace sherd
