#include "cuda/device_query.h"

#include <cuda_runtime.h>

#include "cuda/renderers.h"

namespace sherd {
namespace {

// Present for every architecture the build was made for; asked for to see whether this GPU's is one
// of them.
__global__ void ProbeKernel(int* out) { *out = 1; }

std::string VersionText(int major, int minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

std::string CudaDevice::Describe() const {
  return name + ", " + VersionText(major, minor) + ", " + std::to_string(memory_bytes >> 30) +
         " GB";
}

std::string ExplainNoDevices(int cuda_error, int device_count, int driver_version) {
  if (cuda_error == cudaSuccess && device_count > 0) return "";
  if (cuda_error == cudaErrorInsufficientDriver || driver_version == 0) {
    if (driver_version == 0) return "no NVIDIA driver";
    return "the NVIDIA driver is too old: it supports CUDA " +
           VersionText(driver_version / 1000, driver_version % 1000 / 10) + ", this build needs " +
           VersionText(CUDART_VERSION / 1000, CUDART_VERSION % 1000 / 10);
  }
  if (cuda_error == cudaErrorNoDevice || cuda_error == cudaSuccess) {
    return "no NVIDIA GPU in this machine";
  }
  return std::string("the NVIDIA driver does not answer: ") +
         cudaGetErrorString(static_cast<cudaError_t>(cuda_error));
}

bool FindCudaDevice(CudaDevice* device, std::string* reason) {
  int count = 0, driver = 0;
  const cudaError_t code = cudaGetDeviceCount(&count);
  cudaGetLastError();
  if (cudaDriverGetVersion(&driver) != cudaSuccess) driver = 0;
  *reason = ExplainNoDevices(code, count, driver);
  if (!reason->empty()) return false;
  for (int idx = 0; idx < count; ++idx) {
    cudaDeviceProp properties;
    if (cudaGetDeviceProperties(&properties, idx) != cudaSuccess) {
      *reason = "device " + std::to_string(idx) + " does not answer";
      cudaGetLastError();
      continue;
    }
    CudaDevice found;
    found.idx = idx;
    found.name = properties.name;
    found.major = properties.major;
    found.minor = properties.minor;
    found.memory_bytes = properties.totalGlobalMem;
    cudaFuncAttributes attributes;
    cudaError_t usable = cudaSetDevice(idx);
    if (usable == cudaSuccess) usable = cudaFuncGetAttributes(&attributes, ProbeKernel);
    if (usable == cudaSuccess) {
      *device = found;
      reason->clear();
      return true;
    }
    cudaGetLastError();
    const std::string architecture = VersionText(found.major, found.minor);
    if (found.major * 10 + found.minor < 75) {
      *reason = "the architecture " + architecture + " of " + found.name + " is older than 7.5";
    } else if (usable == cudaErrorNoKernelImageForDevice ||
               usable == cudaErrorInvalidDeviceFunction ||
               usable == cudaErrorUnsupportedPtxVersion) {
      *reason = "this build has no code for the architecture " + architecture + " of " + found.name;
    } else {
      *reason = found.name + " cannot be used: " + cudaGetErrorString(usable);
    }
  }
  return false;
}

CudaStatus QueryCuda() {
  CudaDevice device;
  CudaStatus status;
  status.available = FindCudaDevice(&device, &status.reason);
  if (status.available) status.device = device.Describe();
  return status;
}

}  // namespace sherd
