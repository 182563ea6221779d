// The CUDA renderer's kernels and pipeline, run on the CPU by plain loops: the same text as on the
// GPU, for machines that have none. For tests and checks, not for speed.
#pragma once

#include <cstdint>
#include <memory>

#include "cuda/kernels/block.h"
#include "cuda/machine.h"
#include "cuda/photo_shader.h"
#include "cuda/profiling.h"
#include "metaball/scene.h"

namespace sherd {

struct HostLoopOptions {
  // What the pipeline may reserve; smaller values make it render in parts or refuse.
  std::uint64_t memory_bytes = std::uint64_t{64} << 30;
  // The order in which the threads of a block run between two barriers.
  kernels::ThreadOrder order = kernels::ThreadOrder::kForward;
};

// What it is, for people.
inline constexpr const char* kHostLoopDevice = "the CUDA kernels' bodies on the CPU";

// backend() is "host-loop".
std::unique_ptr<ProfilingRenderer> MakeHostLoopRenderer(const HostLoopOptions& options = {});

// The store of photographs and its kernels; memory_bytes may cut the pool short.
std::unique_ptr<ProfilingPhotoShader> MakeHostLoopPhotoShader(std::uint64_t pool_bytes,
                                                              const HostLoopOptions& options = {});

// The operations that the kernels would do for this frame, counted.
FrameWork CountFrameWork(const Scene& scene, const Camera& camera, const RenderSettings& settings);

}  // namespace sherd
