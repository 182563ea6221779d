// Which renderers this machine can run, and the choice among them.
#pragma once

#include <memory>
#include <string>

#include "cuda/device_choice.h"
#include "cuda/gpu_list.h"
#include "metaball/photo/photo_shader.h"
#include "metaball/renderer.h"

namespace sherd {

// Whether a GPU can be used, and for people why not ("built without CUDA", "no NVIDIA driver", "GPU
// 0 (NVIDIA GTX 1080): its architecture 6.1 is older than 7.5").
struct CudaStatus {
  bool available = false;
  std::string device;  // the first GPU that can be used, where available
  std::string reason;  // where not
};
CudaStatus QueryCuda();

// The first GPU that can be used. Throws DeviceError with QueryCuda's reason where none can.
CudaDevice FirstUsableGpu();

// ChooseRenderer (device_choice.h) on this machine.
std::unique_ptr<Renderer> MakeRenderer(const DeviceChoice& choice, std::string* why = nullptr);

// What looks photographs up on the GPU that draws for `renderer`, in at most a quarter of the GPU's
// free memory; null where the CPU draws or the GPU refuses.
std::unique_ptr<PhotoShader> MakePhotoShader(const Renderer& renderer);

}  // namespace sherd
