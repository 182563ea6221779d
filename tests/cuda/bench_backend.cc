#include "bench_backend.h"

#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include "cuda/cuda_renderer.h"
#include "cuda/cuda_thesis_renderer.h"
#include "cuda/host_loop.h"
#include "cuda/renderers.h"

namespace sherd {
namespace {

// A renderer of the host loop, whose kernels nobody times.
class WithoutProfile final : public ProfilingRenderer {
 public:
  explicit WithoutProfile(std::unique_ptr<Renderer> inner) : inner_(std::move(inner)) {}

  std::string backend() const override { return inner_->backend(); }
  std::string device() const override { return inner_->device(); }
  void Recycle(Frame frame) override { inner_->Recycle(std::move(frame)); }
  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    return inner_->Render(scene, camera, settings, control);
  }
  void EnableProfile(bool) override {}
  std::vector<KernelTime> LastKernels() const override { return {}; }

 private:
  std::unique_ptr<Renderer> inner_;
};

}  // namespace

BenchBackend::BenchBackend(const std::string& name) {
  if (name == "cuda") {
    gpu_ = FirstUsableGpu();
  } else if (name != "host-loop") {
    throw std::invalid_argument("--backend: '" + name + "' is neither cuda nor host-loop");
  }
}

std::unique_ptr<ProfilingRenderer> BenchBackend::MakeRenderer() const {
  if (gpu_) return MakeCudaRenderer(*gpu_);
  return std::make_unique<WithoutProfile>(MakeHostLoopRenderer());
}

std::unique_ptr<ProfilingRenderer> BenchBackend::MakeThesisRenderer(
    const ThesisOptions& options) const {
  if (gpu_) return MakeCudaThesisRenderer(*gpu_, options);
  return std::make_unique<WithoutProfile>(
      MakeHostLoopThesisRenderer(options, ThesisPrecision::kFloat));
}

std::unique_ptr<PhotoTileSampler> BenchBackend::MakePhotoSampler() const {
  constexpr std::uint64_t kHostPool = std::uint64_t{256} << 20;
  return gpu_ ? MakeCudaPhotoSampler(0, gpu_->idx) : MakeHostLoopPhotoSampler(kHostPool);
}

}  // namespace sherd
