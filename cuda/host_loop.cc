#include "cuda/host_loop.h"

#include <string>
#include <utility>

#include "cuda/frame_pipeline.h"
#include "cuda/host_machine.h"
#include "cuda/photo_tile_store.h"

namespace sherd {
namespace {

class HostLoopRenderer final : public Renderer {
 public:
  explicit HostLoopRenderer(const HostLoopOptions& options)
      : pipeline_(HostMachine<false>(options.memory_bytes, options.order)) {}

  std::string backend() const override { return "host-loop"; }
  std::string device() const override { return "the CUDA kernels' bodies on the CPU"; }

  void Recycle(Frame frame) override { pipeline_.Recycle(std::move(frame)); }
  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    Frame frame = pipeline_.Render(scene, camera, settings, control);
    frame.stats.backend = backend();
    frame.stats.device = device();
    return frame;
  }

 private:
  FramePipeline<HostMachine<false>> pipeline_;
};

}  // namespace

std::unique_ptr<Renderer> MakeHostLoopRenderer(const HostLoopOptions& options) {
  return std::make_unique<HostLoopRenderer>(options);
}

std::unique_ptr<PhotoTileSampler> MakeHostLoopPhotoSampler(std::uint64_t pool_bytes,
                                                           const HostLoopOptions& options) {
  return std::make_unique<PhotoTileStore<HostMachine<false>>>(
      HostMachine<false>(options.memory_bytes, options.order), pool_bytes);
}

FrameWork CountFrameWork(const Scene& scene, const Camera& camera, const RenderSettings& settings) {
  FramePipeline<HostMachine<true>> pipeline(
      HostMachine<true>(HostLoopOptions{}.memory_bytes, kernels::ThreadOrder::kForward));
  pipeline.Render(scene, camera, settings, {});
  return pipeline.work();
}

}  // namespace sherd
