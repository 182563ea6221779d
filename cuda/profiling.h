// Where a frame's time went, kernel by kernel.
#pragma once

#include <vector>

#include "cuda/machine.h"
#include "metaball/renderer.h"

namespace sherd {

class ProfilingRenderer : public Renderer {
 public:
  // Measures every kernel from the next frame on (by CUDA events on a GPU); costs a little itself.
  virtual void EnableProfile(bool enable) = 0;
  // Kernels and library calls of the last frame, in their order. Empty when not enabled.
  virtual std::vector<KernelTime> LastKernels() const = 0;
};

}  // namespace sherd
