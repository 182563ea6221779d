// Asks CUDA which GPUs there are and which of them this build can use.
#pragma once

#include <string>

#include "cuda/gpu_list.h"

namespace sherd {

// Every GPU with what it tells of itself. Takes no memory on any of them, so that a GPU is good for
// work may still turn out wrong: WhyUnusable.
GpuList ListGpus();

// Why this build's kernels cannot run on the GPU, for people; empty where they can. Takes the
// memory of a CUDA context on it.
std::string WhyUnusable(const CudaDevice& device);

// What cudaGetDeviceCount's result means; empty when there is something to look at.
// driver_version: cudaDriverGetVersion's number, 0 without a driver.
std::string ExplainNoDevices(int cuda_error, int device_count, int driver_version);

// What it means that asking a GPU for this build's kernels ended in `cuda_error`; empty for
// success.
std::string ExplainUnusable(const CudaDevice& device, int cuda_error);

}  // namespace sherd
