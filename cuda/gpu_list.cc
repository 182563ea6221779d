#include "cuda/gpu_list.h"

namespace sherd {

std::string CudaDevice::architecture() const {
  return std::to_string(major) + "." + std::to_string(minor);
}

std::string CudaDevice::Label() const {
  const std::string number = "GPU " + std::to_string(idx);
  return name.empty() ? number : number + " (" + name + ")";
}

std::string CudaDevice::Describe() const {
  return name + ", " + architecture() + ", " + std::to_string(memory_bytes >> 30) + " GB";
}

std::string CudaVersionText(int version) {
  if (version == 0) return "none";
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

std::string LabelsOf(const std::vector<CudaDevice>& devices) {
  std::string text;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (i > 0) text += i + 1 == devices.size() ? " and " : ", ";
    text += devices[i].Label();
  }
  return text;
}

}  // namespace sherd
