// Which renderers this machine can run, and the choice among them.
#pragma once

#include <memory>
#include <string>

#include "metaball/photo/sampler.h"
#include "metaball/renderer.h"

namespace sherd {

enum class Backend { kAuto, kCpu, kCuda };
// "auto", "cpu", "cuda"; InputError otherwise.
Backend ParseBackend(const std::string& name);

// Whether a GPU can be used, and for people why not ("built without CUDA", "no NVIDIA driver", "the
// GPU's architecture 6.1 is older than 7.5").
struct CudaStatus {
  bool available = false;
  std::string device;  // the GPU's name where available
  std::string reason;  // where not
};
CudaStatus QueryCuda();

// kAuto: the GPU where there is one, else the CPU; `why`, when given, receives one line that says
// what was chosen and why. kCuda throws DeviceError when no GPU can be used.
std::unique_ptr<Renderer> MakeRenderer(Backend backend, std::string* why = nullptr);

// What looks photographs up on the GPU that draws for `renderer`, in at most a quarter of the GPU's
// free memory; null where the CPU draws or the GPU refuses.
std::unique_ptr<PhotoSampler> MakePhotoSampler(const Renderer& renderer);

}  // namespace sherd
