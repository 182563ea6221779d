#include "cuda/host_loop.h"

#include "cuda/frame_pipeline.h"
#include "cuda/host_machine.h"
#include "cuda/photo_pass.h"
#include "cuda/pipeline_renderer.h"

namespace sherd {

std::unique_ptr<ProfilingRenderer> MakeHostLoopRenderer(const HostLoopOptions& options) {
  return std::make_unique<PipelineRenderer<FramePipeline<HostMachine<false>>>>(
      RendererNames{"host-loop", kHostLoopDevice},
      HostMachine<false>(options.memory_bytes, options.order));
}

std::unique_ptr<ProfilingPhotoShader> MakeHostLoopPhotoShader(std::uint64_t pool_bytes,
                                                              const HostLoopOptions& options) {
  return std::make_unique<PhotoPass<HostMachine<false>>>(
      HostMachine<false>(options.memory_bytes, options.order), pool_bytes);
}

FrameWork CountFrameWork(const Scene& scene, const Camera& camera, const RenderSettings& settings) {
  FramePipeline<HostMachine<true>> pipeline(
      HostMachine<true>(HostLoopOptions{}.memory_bytes, kernels::ThreadOrder::kForward));
  pipeline.Render(scene, camera, settings, {});
  return pipeline.work();
}

}  // namespace sherd
