#include "bench_backend.h"

#include <cstdint>
#include <stdexcept>

#include "cuda/cuda_renderer.h"
#include "cuda/cuda_thesis_renderer.h"
#include "cuda/host_loop.h"
#include "cuda/renderers.h"

namespace sherd {

BenchBackend::BenchBackend(const std::string& name) {
  if (name == "cuda") {
    gpu_ = FirstUsableGpu();
  } else if (name != "host-loop") {
    throw std::invalid_argument("--backend: '" + name + "' is neither cuda nor host-loop");
  }
}

std::unique_ptr<ProfilingRenderer> BenchBackend::MakeRenderer() const {
  if (gpu_) return MakeCudaRenderer(*gpu_);
  return MakeHostLoopRenderer();
}

std::unique_ptr<ProfilingRenderer> BenchBackend::MakeThesisRenderer(
    const ThesisOptions& options) const {
  if (gpu_) return MakeCudaThesisRenderer(*gpu_, options);
  return MakeHostLoopThesisRenderer(options, ThesisPrecision::kFloat);
}

std::unique_ptr<ProfilingPhotoShader> BenchBackend::MakePhotoShader() const {
  constexpr std::uint64_t kHostPool = std::uint64_t{256} << 20;
  return gpu_ ? MakeCudaPhotoShader(0, gpu_->idx) : MakeHostLoopPhotoShader(kHostPool);
}

}  // namespace sherd
