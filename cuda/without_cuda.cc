// What a build without the CUDA toolkit answers.
#include "cuda/cuda_renderer.h"
#include "cuda/cuda_thesis_renderer.h"
#include "cuda/device_query.h"
#include "cuda/photo_shader.h"
#include "metaball/error.h"

namespace sherd {
namespace {

constexpr const char* kReason = "built without CUDA";

}  // namespace

GpuList ListGpus() {
  GpuList list;
  list.reason = kReason;
  return list;
}

std::string WhyUnusable(const CudaDevice&) { return kReason; }

std::unique_ptr<ProfilingRenderer> MakeCudaRenderer(const CudaDevice&) {
  throw DeviceError("CUDA", 0, kReason);
}

std::unique_ptr<ProfilingRenderer> MakeCudaThesisRenderer(const CudaDevice&,
                                                          const ThesisOptions& options,
                                                          ThesisPrecision) {
  CheckThesisOptions(options);
  throw DeviceError("CUDA", 0, kReason);
}

std::unique_ptr<ProfilingPhotoShader> MakeCudaPhotoShader(std::uint64_t, int) {
  throw DeviceError("CUDA", 0, kReason);
}

}  // namespace sherd
