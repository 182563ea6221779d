// The renderer on a GPU: the pipeline of frame_pipeline.h over a DeviceMachine.
#include "cuda/cuda_renderer.h"

#include "cuda/device_machine.h"
#include "cuda/frame_pipeline.h"
#include "cuda/pipeline_renderer.h"

namespace sherd {

std::unique_ptr<ProfilingRenderer> MakeCudaRenderer(const CudaDevice& device) {
  return std::make_unique<PipelineRenderer<FramePipeline<DeviceMachine>>>(
      RendererNames{"cuda", device.Describe(), device.idx}, DeviceMachine(device.idx));
}

}  // namespace sherd
