// The thesis's method (metaball/thesis/thesis_renderer.h) on a GPU: a rival to measure our own
// against on the same device, with the faults that the method has.
#pragma once

#include <memory>

#include "cuda/gpu_list.h"
#include "cuda/host_loop.h"
#include "cuda/profiling.h"
#include "metaball/thesis/thesis_renderer.h"

namespace sherd {

// The numbers rays are traced in: floats, as one would on a GPU, or doubles, as on the CPU.
enum class ThesisPrecision { kFloat, kDouble };

// The octree is built on the CPU and kept on the GPU until the cloud or a radius changes
// (RenderStats::seconds_prepare). Throws as MakeCudaRenderer and MakeThesisRenderer do. Render
// throws Error for further planes than colour, depth, normals and metaballs, DeviceError when the
// GPU fails in the middle, ResourceError when octree, metaballs or a row of the picture do not fit
// in its memory.
std::unique_ptr<ProfilingRenderer> MakeCudaThesisRenderer(
    const CudaDevice& device, const ThesisOptions& options = {},
    ThesisPrecision precision = ThesisPrecision::kFloat);

// The same kernels and pipeline by plain loops on the CPU (host_loop.h); backend() is "host-loop".
// In doubles its pictures are those of MakeThesisRenderer.
std::unique_ptr<ProfilingRenderer> MakeHostLoopThesisRenderer(
    const ThesisOptions& options = {}, ThesisPrecision precision = ThesisPrecision::kDouble,
    const HostLoopOptions& machine = {});

}  // namespace sherd
