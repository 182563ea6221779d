// What the CPU's renderers do around every frame.
#pragma once

#include <string>

#include "metaball/control.h"
#include "metaball/frame.h"
#include "metaball/renderer.h"
#include "metaball/scene.h"
#include "metaball/trace_job.h"

namespace sherd {

// An empty frame that says who draws what, in the memory of `spare` where that suffices. Throws as
// MakeFrame does.
Frame BeginFrame(const Renderer& renderer, const std::string& device, const Scene& scene,
                 const Camera& camera, const Planes& planes, Frame spare = {});

// A frame of the scene in floats, not yet sorted into tiles: camera in world coordinates. Scene,
// bins and frame must outlive the job.
TraceJob JobOf(const Scene& scene, const Camera& camera, const TileBins* bins, Frame* frame);

// Sorts the job's metaballs into its bins, timed and counted. Throws as TileBins::Build does.
void BinMetaballs(const TraceJob& job, int threads, const Control& control, TileBins* bins,
                  RenderStats* stats);

void AddCounts(const TraceCounts& counts, RenderStats* stats);

// "2 threads, AVX2". threads: as RenderSettings has them.
std::string ThreadsAnd(int threads, const std::string& what);

}  // namespace sherd
