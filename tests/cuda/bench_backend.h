// What a benchmark measures: the renderers and the sampler of one backend.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "cuda/gpu_list.h"
#include "cuda/photo_shader.h"
#include "cuda/profiling.h"
#include "metaball/thesis/thesis_renderer.h"

namespace sherd {

class BenchBackend {
 public:
  // "cuda": the first GPU that can be used. "host-loop": the kernels' bodies run on the CPU, for
  // trying a benchmark out; its kernels are not timed one by one. Throws DeviceError where there is
  // no GPU, std::invalid_argument for another name.
  explicit BenchBackend(const std::string& name);

  bool measures_a_gpu() const { return gpu_.has_value(); }
  std::string name() const { return gpu_ ? "cuda" : "host-loop"; }

  std::unique_ptr<ProfilingRenderer> MakeRenderer() const;
  // In floats.
  std::unique_ptr<ProfilingRenderer> MakeThesisRenderer(const ThesisOptions& options) const;
  std::unique_ptr<ProfilingPhotoShader> MakePhotoShader() const;

 private:
  std::optional<CudaDevice> gpu_;
};

}  // namespace sherd
