#include "cuda/device_query.h"

#include <cuda_runtime.h>

namespace sherd {
namespace {

constexpr int kOldestMajor = 7, kOldestMinor = 5;  // of the architectures that are built for

// Present for every architecture the build was made for; asked for to see whether this GPU's is one
// of them.
__global__ void ProbeKernel(int* out) { *out = 1; }

CudaDevice PropertiesOf(int idx) {
  CudaDevice device;
  device.idx = idx;
  cudaDeviceProp properties;
  const cudaError_t code = cudaGetDeviceProperties(&properties, idx);
  if (code != cudaSuccess) {
    cudaGetLastError();
    device.why_not = std::string("it does not answer: ") + cudaGetErrorString(code);
    return device;
  }
  device.name = properties.name;
  device.major = properties.major;
  device.minor = properties.minor;
  device.memory_bytes = properties.totalGlobalMem;
  device.why_not = ExplainUnusable(device, cudaSuccess);
  return device;
}

}  // namespace

std::string ExplainNoDevices(int cuda_error, int device_count, int driver_version) {
  if (cuda_error == cudaSuccess && device_count > 0) return "";
  if (cuda_error == cudaErrorInsufficientDriver || driver_version == 0) {
    if (driver_version == 0) return "no NVIDIA driver";
    return "the NVIDIA driver is too old: it supports CUDA " + CudaVersionText(driver_version) +
           ", this build needs " + CudaVersionText(CUDART_VERSION);
  }
  if (cuda_error == cudaErrorNoDevice || cuda_error == cudaSuccess) {
    return "no NVIDIA GPU in this machine";
  }
  return std::string("the NVIDIA driver does not answer: ") +
         cudaGetErrorString(static_cast<cudaError_t>(cuda_error));
}

std::string ExplainUnusable(const CudaDevice& device, int cuda_error) {
  if (device.major * 10 + device.minor < kOldestMajor * 10 + kOldestMinor) {
    return "its architecture " + device.architecture() + " is older than " +
           std::to_string(kOldestMajor) + "." + std::to_string(kOldestMinor);
  }
  if (cuda_error == cudaSuccess) return "";
  if (cuda_error == cudaErrorNoKernelImageForDevice ||
      cuda_error == cudaErrorInvalidDeviceFunction ||
      cuda_error == cudaErrorUnsupportedPtxVersion) {
    return "this build has no code for its architecture " + device.architecture();
  }
  return std::string("it cannot be used: ") +
         cudaGetErrorString(static_cast<cudaError_t>(cuda_error));
}

GpuList ListGpus() {
  GpuList list;
  list.toolkit_version = CUDART_VERSION;
  int count = 0;
  const cudaError_t code = cudaGetDeviceCount(&count);
  cudaGetLastError();
  if (cudaDriverGetVersion(&list.driver_version) != cudaSuccess) list.driver_version = 0;
  list.reason = ExplainNoDevices(code, count, list.driver_version);
  if (!list.reason.empty()) return list;
  for (int idx = 0; idx < count; ++idx) list.devices.push_back(PropertiesOf(idx));
  return list;
}

std::string WhyUnusable(const CudaDevice& device) {
  if (!device.why_not.empty()) return device.why_not;
  cudaError_t code = cudaSetDevice(device.idx);
  cudaFuncAttributes attributes;
  if (code == cudaSuccess) code = cudaFuncGetAttributes(&attributes, ProbeKernel);
  cudaGetLastError();
  return ExplainUnusable(device, code);
}

}  // namespace sherd
