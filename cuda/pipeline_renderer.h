// A Renderer in front of a pipeline (frame_pipeline.h, thesis_pipeline.h) on whichever machine.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "cuda/profiling.h"
#include "metaball/appearance/deferred.h"
#include "metaball/supersample.h"

namespace sherd {

struct RendererNames {
  std::string backend, device;
  int gpu = Renderer::kNoGpu;
};

template <class Pipeline>
class PipelineRenderer final : public ProfilingRenderer {
 public:
  // pipeline: what the pipeline is made of.
  template <class... Args>
  explicit PipelineRenderer(RendererNames names, Args&&... pipeline)
      : names_(std::move(names)), pipeline_(std::forward<Args>(pipeline)...) {}

  std::string backend() const override { return names_.backend; }
  std::string device() const override { return names_.device; }
  int gpu() const override { return names_.gpu; }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    if constexpr (!Pipeline::kDrawsEverything) {
      if (NeedsDeferredPasses(scene, settings.planes)) {
        return RenderDeferred(this, scene, camera, settings, control);
      }
      CheckRenderInput(scene, camera, settings);
      if (settings.supersample > 1) {
        return RenderSupersampled(this, scene, camera, settings, control);
      }
    }
    Frame frame = pipeline_.Render(scene, camera, settings, control);
    frame.stats.backend = names_.backend;
    frame.stats.device = names_.device;
    return frame;
  }

  void Recycle(Frame frame) override {
    if constexpr (Pipeline::kDrawsEverything) pipeline_.Recycle(std::move(frame));
  }

  void EnableProfile(bool enable) override { pipeline_.machine().EnableProfile(enable); }
  std::vector<KernelTime> LastKernels() const override { return pipeline_.machine().times(); }

 private:
  RendererNames names_;
  Pipeline pipeline_;
};

}  // namespace sherd
