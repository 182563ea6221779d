// The backends that programs check and measure, by the names of their options.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "metaball/renderer.h"

namespace sherd {

// "host-loop", and "cuda" where a GPU can be used: what is held against the CPU.
std::vector<std::string> BackendsBesideTheCpu();

// "cpu", "host-loop" (the CUDA kernels' bodies run on the CPU) or "cuda" (the first GPU that can be
// used). Throws DeviceError where there is none, std::invalid_argument for another name.
std::unique_ptr<Renderer> MakeBackend(const std::string& name);

}  // namespace sherd
