// Which GPU this build can use.
#pragma once

#include <cstdint>
#include <string>

namespace sherd {

struct CudaDevice {
  int idx = 0;
  std::string name;
  int major = 0, minor = 0;  // compute capability
  std::uint64_t memory_bytes = 0;

  // "NVIDIA H200, 9.0, 140 GB".
  std::string Describe() const;
};

// The first device that runs this build's kernels; else false, and why for people.
bool FindCudaDevice(CudaDevice* device, std::string* reason);

// What cudaGetDeviceCount's result means; empty when there is something to look at.
// driver_version: cudaDriverGetVersion's number (13000 is 13.0), 0 without a driver.
std::string ExplainNoDevices(int cuda_error, int device_count, int driver_version);

}  // namespace sherd
