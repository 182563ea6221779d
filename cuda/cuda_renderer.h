// The renderer on a GPU itself; programs take it through MakeRenderer (renderers.h), which adds the
// way back to the CPU.
#pragma once

#include <memory>

#include "cuda/gpu_list.h"
#include "cuda/profiling.h"

namespace sherd {

// Draws on that GPU, which WhyUnusable (device_query.h) has nothing against. Throws DeviceError
// where CUDA refuses it, and in a build without CUDA. Render throws DeviceError when the GPU fails
// in the middle, ResourceError when the scene or the smallest part of the picture does not fit in
// its memory.
std::unique_ptr<ProfilingRenderer> MakeCudaRenderer(const CudaDevice& device);

}  // namespace sherd
