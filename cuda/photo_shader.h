// Photographs on a frame's surface by a GPU; programs take it through MakePhotoShader
// (renderers.h).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "cuda/machine.h"
#include "metaball/photo/photo_shader.h"

namespace sherd {

// One whose photographs are tiles in a pool, and whose kernels can be timed.
class ProfilingPhotoShader : public PhotoShader {
 public:
  struct Use {
    std::uint64_t pool_bytes = 0;    // reserved so far
    std::uint64_t tiles_held = 0;    // at this moment
    std::uint64_t tiles_loaded = 0;  // since the beginning
    std::uint64_t rounds = 0;  // one for half a million pixels, two where tiles are missing, more
                               // where the pool is short
  };
  virtual Use use() const = 0;
  // As ProfilingRenderer's.
  virtual void EnableProfile(bool enable) = 0;
  virtual std::vector<KernelTime> LastKernels() const = 0;
};

// On the GPU that CUDA numbers so. pool_bytes: of photographs' pixels held at any time; 0: a
// quarter of the GPU's free memory, at most 4 GiB. Nothing is reserved before it is needed. Throws
// DeviceError when the GPU cannot be used, ResourceError when pool_bytes is too small for a single
// lookup (147456).
std::unique_ptr<ProfilingPhotoShader> MakeCudaPhotoShader(std::uint64_t pool_bytes, int gpu);

}  // namespace sherd
