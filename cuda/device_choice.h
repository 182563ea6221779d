// What is to draw, as a value that options and settings hold, and what it comes to on a machine.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "cuda/gpu_list.h"
#include "metaball/renderer.h"

namespace sherd {

enum class Backend { kAuto, kCpu, kCuda };

struct DeviceChoice {
  // The first GPU that can be used: CUDA numbers the fastest first.
  static constexpr int kFirst = -1;
  // All that can be used, each a part of every picture.
  static constexpr int kAll = -2;

  Backend backend = Backend::kAuto;
  int gpu = kFirst;  // kCuda alone: CUDA's number, kFirst or kAll

  // As ParseDeviceChoice reads it.
  std::string Text() const;

  friend bool operator==(const DeviceChoice&, const DeviceChoice&) = default;
};

// "auto", "cpu", "cuda", "cuda:2", "cuda:all"; InputError otherwise.
DeviceChoice ParseDeviceChoice(const std::string& text);

// Makes the renderer of one GPU or throws an Error that says why it cannot be used.
using GpuFactory = std::function<std::unique_ptr<Renderer>(const CudaDevice&)>;

// The renderer of a choice where `gpus` are there; it goes back to the CPU where the GPUs fail in
// the middle. kAuto takes one GPU, not all: every GPU would hold the whole cloud and sort it anew
// for its part, so that a frame which one draws in milliseconds gains little, and the others may be
// at work for somebody else. `why`, when given, receives one line that says what was chosen and
// why. Throws DeviceError when a GPU is asked for that is not there (the line names those that are)
// or cannot be used.
std::unique_ptr<Renderer> ChooseRenderer(const DeviceChoice& choice, const GpuList& gpus,
                                         const GpuFactory& make_gpu, std::string* why = nullptr);

}  // namespace sherd
