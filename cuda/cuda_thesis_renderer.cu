// The thesis's method on a GPU: the pipeline of thesis_pipeline.h over a DeviceMachine.
#include "cuda/cuda_thesis_renderer.h"

#include <string>

#include "cuda/device_machine.h"
#include "cuda/thesis_pipeline.h"

namespace sherd {
namespace {

class CudaThesisRenderer final : public ProfilingRenderer {
 public:
  CudaThesisRenderer(const CudaDevice& device, const ThesisOptions& options,
                     ThesisPrecision precision)
      : pipeline_(DeviceMachine(device.idx), options, precision),
        name_(device.Describe() + ", " + pipeline_.Describe()) {}

  std::string backend() const override { return "cuda"; }
  std::string device() const override { return name_; }

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

  void EnableProfile(bool enable) override { pipeline_.machine().EnableProfile(enable); }
  std::vector<KernelTime> LastKernels() const override { return pipeline_.machine().times(); }

 private:
  ThesisPipeline<DeviceMachine> pipeline_;
  std::string name_;
};

}  // namespace

std::unique_ptr<ProfilingRenderer> MakeCudaThesisRenderer(const CudaDevice& device,
                                                          const ThesisOptions& options,
                                                          ThesisPrecision precision) {
  CheckThesisOptions(options);
  return std::make_unique<CudaThesisRenderer>(device, options, precision);
}

}  // namespace sherd
