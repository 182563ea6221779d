// The GPUs of a machine, as values: what programs list and choose from.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sherd {

struct CudaDevice {
  int idx = 0;  // CUDA's number, which counts only what CUDA_VISIBLE_DEVICES lets it see
  std::string name;
  int major = 0, minor = 0;  // compute capability
  std::uint64_t memory_bytes = 0;
  // Why it cannot be used, for people; empty where nothing is known against it.
  std::string why_not;

  std::string architecture() const;  // "9.0"
  // "GPU 0 (NVIDIA H200)"; "GPU 0" where it did not tell its name.
  std::string Label() const;
  // "NVIDIA H200, 9.0, 140 GB".
  std::string Describe() const;
};

struct GpuList {
  std::vector<CudaDevice> devices;  // device i has idx i
  std::string reason;               // why there are none; empty where there are
  // CUDA versions as CUDA counts them, 13000 is 13.0; 0: no driver, built without the toolkit.
  int driver_version = 0;   // the newest the driver knows
  int toolkit_version = 0;  // what the program was built with
};

// 13000: "13.0". 0: "none".
std::string CudaVersionText(int version);

// "GPU 0 (NVIDIA H200) and GPU 1 (NVIDIA L4)"; empty for none.
std::string LabelsOf(const std::vector<CudaDevice>& devices);

}  // namespace sherd
