#include "cuda/renderers.h"

#include <optional>

#include "cuda/cuda_renderer.h"
#include "cuda/device_query.h"
#include "cuda/photo_shader.h"
#include "metaball/error.h"

namespace sherd {
namespace {

// Asks one GPU after the other, so that none is set to work beyond the first that can be used.
std::optional<CudaDevice> FindUsableGpu(std::string* reason) {
  const GpuList gpus = ListGpus();
  *reason = gpus.reason;
  for (const CudaDevice& device : gpus.devices) {
    const std::string why_not = WhyUnusable(device);
    if (why_not.empty()) return device;
    *reason += (reason->empty() ? "" : "; ") + device.Label() + ": " + why_not;
  }
  return std::nullopt;
}

}  // namespace

CudaStatus QueryCuda() {
  CudaStatus status;
  const std::optional<CudaDevice> device = FindUsableGpu(&status.reason);
  if (device) status = {true, device->Describe(), ""};
  return status;
}

CudaDevice FirstUsableGpu() {
  std::string reason;
  const std::optional<CudaDevice> device = FindUsableGpu(&reason);
  if (!device) throw DeviceError("CUDA", 0, reason);
  return *device;
}

std::unique_ptr<Renderer> MakeRenderer(const DeviceChoice& choice, std::string* why) {
  const auto make_gpu = [](const CudaDevice& device) -> std::unique_ptr<Renderer> {
    const std::string why_not = WhyUnusable(device);
    if (!why_not.empty()) throw Error(why_not);
    return MakeCudaRenderer(device);
  };
  return ChooseRenderer(choice, choice.backend == Backend::kCpu ? GpuList{} : ListGpus(), make_gpu,
                        why);
}

std::unique_ptr<PhotoShader> MakePhotoShader(const Renderer& renderer) {
  if (renderer.gpu() == Renderer::kNoGpu) return nullptr;
  try {
    return MakeCudaPhotoShader(0, renderer.gpu());
  } catch (const DeviceError&) {
    return nullptr;  // what it looks up, the CPU does
  } catch (const ResourceError&) {
    return nullptr;
  }
}

}  // namespace sherd
