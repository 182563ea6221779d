// The GPUs of a machine, as text and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "cuda/gpu_list.h"

namespace sherd::cli {

// One row for CUDA itself and one for each GPU: what it is called and what it is, with the reason
// where it cannot be used.
std::vector<std::vector<std::string>> DeviceRows(const GpuList& gpus);
// An array: index, name, architecture, memory_bytes, available, reason (null where available).
Json ToJson(const std::vector<CudaDevice>& devices);

}  // namespace sherd::cli
