// The thesis's method by the CUDA kernel's body, run by plain loops on the CPU.
#include "cuda/cuda_thesis_renderer.h"
#include "cuda/host_machine.h"
#include "cuda/pipeline_renderer.h"
#include "cuda/thesis_pipeline.h"

namespace sherd {

std::unique_ptr<ProfilingRenderer> MakeHostLoopThesisRenderer(const ThesisOptions& options,
                                                              ThesisPrecision precision,
                                                              const HostLoopOptions& machine) {
  return std::make_unique<PipelineRenderer<ThesisPipeline<HostMachine<false>>>>(
      RendererNames{"host-loop",
                    std::string(kHostLoopDevice) + ", " + DescribeThesis(options, precision)},
      HostMachine<false>(machine.memory_bytes, machine.order), options, precision);
}

}  // namespace sherd
