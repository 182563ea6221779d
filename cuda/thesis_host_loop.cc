// The thesis's method by the CUDA kernel's body, run by plain loops on the CPU.
#include <string>

#include "cuda/cuda_thesis_renderer.h"
#include "cuda/host_machine.h"
#include "cuda/thesis_pipeline.h"

namespace sherd {
namespace {

class HostLoopThesisRenderer final : public Renderer {
 public:
  HostLoopThesisRenderer(const ThesisOptions& options, ThesisPrecision precision,
                         const HostLoopOptions& machine)
      : pipeline_(HostMachine<false>(machine.memory_bytes, machine.order), options, precision) {}

  std::string backend() const override { return "host-loop"; }
  std::string device() const override {
    return "the CUDA kernels' bodies on the CPU, " + pipeline_.Describe();
  }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    if (settings.supersample > 1) {
      CheckRenderInput(scene, camera, settings);
      return RenderSupersampled(this, scene, camera, settings, control);
    }
    Frame frame = pipeline_.Render(scene, camera, settings, control);
    frame.stats.backend = backend();
    frame.stats.device = device();
    return frame;
  }

 private:
  ThesisPipeline<HostMachine<false>> pipeline_;
};

}  // namespace

std::unique_ptr<Renderer> MakeHostLoopThesisRenderer(const ThesisOptions& options,
                                                     ThesisPrecision precision,
                                                     const HostLoopOptions& machine) {
  return std::make_unique<HostLoopThesisRenderer>(options, precision, machine);
}

}  // namespace sherd
