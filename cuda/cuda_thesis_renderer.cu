// The thesis's method on a GPU: the pipeline of thesis_pipeline.h over a DeviceMachine.
#include "cuda/cuda_thesis_renderer.h"

#include "cuda/device_machine.h"
#include "cuda/pipeline_renderer.h"
#include "cuda/thesis_pipeline.h"

namespace sherd {

std::unique_ptr<ProfilingRenderer> MakeCudaThesisRenderer(const CudaDevice& device,
                                                          const ThesisOptions& options,
                                                          ThesisPrecision precision) {
  CheckThesisOptions(options);
  return std::make_unique<PipelineRenderer<ThesisPipeline<DeviceMachine>>>(
      RendererNames{"cuda", device.Describe() + ", " + DescribeThesis(options, precision),
                    device.idx},
      DeviceMachine(device.idx), options, precision);
}

}  // namespace sherd
