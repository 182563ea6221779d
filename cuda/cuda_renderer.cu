// The renderer on a GPU: the pipeline of frame_pipeline.h over a DeviceMachine.
#include "cuda/cuda_renderer.h"

#include <string>
#include <utility>

#include "cuda/device_machine.h"
#include "cuda/frame_pipeline.h"

namespace sherd {
namespace {

class CudaRenderer final : public ProfilingRenderer {
 public:
  explicit CudaRenderer(const CudaDevice& device)
      : gpu_(device.idx), name_(device.Describe()), pipeline_(DeviceMachine(device.idx)) {}

  std::string backend() const override { return "cuda"; }
  std::string device() const override { return name_; }
  int gpu() const override { return gpu_; }

  void Recycle(Frame frame) override { pipeline_.Recycle(std::move(frame)); }
  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    Frame frame = pipeline_.Render(scene, camera, settings, control);
    frame.stats.backend = backend();
    frame.stats.device = device();
    return frame;
  }

  void EnableProfile(bool enable) override { pipeline_.machine().EnableProfile(enable); }
  std::vector<KernelTime> LastKernels() const override { return pipeline_.machine().times(); }

 private:
  int gpu_;
  std::string name_;
  FramePipeline<DeviceMachine> pipeline_;
};

}  // namespace

std::unique_ptr<ProfilingRenderer> MakeCudaRenderer(const CudaDevice& device) {
  return std::make_unique<CudaRenderer>(device);
}

}  // namespace sherd
