#include "cuda/renderers.h"

#include <utility>

#include "cuda/cuda_renderer.h"
#include "cuda/fallback.h"
#include "cuda/photo_sampler.h"
#include "metaball/error.h"

namespace sherd {
namespace {

std::unique_ptr<Renderer> MakeCudaWithFallback() {
  return MakeFallbackRenderer(
      MakeCudaRenderer(), [] { return MakeCudaRenderer(); }, [] { return MakeCpuRenderer(); });
}

void Say(std::string* why, std::string line) {
  if (why) *why = std::move(line);
}

}  // namespace

Backend ParseBackend(const std::string& name) {
  if (name == "auto") return Backend::kAuto;
  if (name == "cpu") return Backend::kCpu;
  if (name == "cuda") return Backend::kCuda;
  throw InputError("", "", "there is no backend '" + name + "'", "use auto, cpu or cuda");
}

std::unique_ptr<Renderer> MakeRenderer(Backend backend, std::string* why) {
  if (backend == Backend::kCpu) {
    auto renderer = MakeCpuRenderer();
    Say(why, "CPU (" + renderer->device() + "), as asked for");
    return renderer;
  }
  std::string reason;
  const CudaStatus status = QueryCuda();
  if (status.available) {
    try {
      auto renderer = MakeCudaWithFallback();
      Say(why,
          "GPU (" + renderer->device() + ")" + (backend == Backend::kCuda ? ", as asked for" : ""));
      return renderer;
    } catch (const Error& error) {
      if (backend == Backend::kCuda) throw;
      reason = error.what();
    }
  } else {
    reason = status.reason;
  }
  if (backend == Backend::kCuda) {
    throw DeviceError("CUDA", 0, "no GPU can be used: " + reason + "; use --backend auto or cpu");
  }
  auto renderer = MakeCpuRenderer();
  Say(why, "CPU (" + renderer->device() + "): " + reason);
  return renderer;
}

std::unique_ptr<PhotoSampler> MakePhotoSampler(const Renderer& renderer) {
  if (renderer.backend() != "cuda") return nullptr;
  try {
    return MakeCudaPhotoSampler(0);
  } catch (const DeviceError&) {
    return nullptr;  // what it looks up, the CPU does
  } catch (const ResourceError&) {
    return nullptr;
  }
}

}  // namespace sherd
