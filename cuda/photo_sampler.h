// Looking photographs up on a GPU; programs take it through MakePhotoSampler (renderers.h).
#pragma once

#include <cstdint>
#include <memory>

#include "metaball/photo/sampler.h"

namespace sherd {

// A sampler whose photographs are tiles in a pool.
class PhotoTileSampler : public PhotoSampler {
 public:
  struct Use {
    std::uint64_t pool_bytes = 0;    // reserved so far
    std::uint64_t tiles_held = 0;    // at this moment
    std::uint64_t tiles_loaded = 0;  // since the beginning
    std::uint64_t rounds = 0;  // one for each photograph and call, more where the pool is short
  };
  virtual Use use() const = 0;
};

// On the GPU that CUDA numbers so. pool_bytes: of pixels held at any time; 0: a quarter of the
// GPU's free memory, at most 4 GiB. Nothing is reserved before it is needed. Throws DeviceError
// when the GPU cannot be used, ResourceError when pool_bytes is too small for a single lookup
// (147456).
std::unique_ptr<PhotoTileSampler> MakeCudaPhotoSampler(std::uint64_t pool_bytes, int gpu);

}  // namespace sherd
