// What a build without the CUDA toolkit answers.
#include "cuda/cuda_renderer.h"
#include "cuda/cuda_thesis_renderer.h"
#include "cuda/photo_sampler.h"
#include "cuda/renderers.h"
#include "metaball/error.h"

namespace sherd {

CudaStatus QueryCuda() { return {false, "", "built without CUDA"}; }

std::unique_ptr<ProfilingRenderer> MakeCudaRenderer() {
  throw DeviceError("CUDA", 0, "built without CUDA");
}

std::unique_ptr<ProfilingRenderer> MakeCudaThesisRenderer(const ThesisOptions& options,
                                                          ThesisPrecision) {
  CheckThesisOptions(options);
  throw DeviceError("CUDA", 0, "built without CUDA");
}

std::unique_ptr<PhotoTileSampler> MakeCudaPhotoSampler(std::uint64_t) {
  throw DeviceError("CUDA", 0, "built without CUDA");
}

}  // namespace sherd
