#include "app/cli/device_list.h"

namespace sherd::cli {

std::vector<std::vector<std::string>> DeviceRows(const GpuList& gpus) {
  const std::string versions = "driver " + CudaVersionText(gpus.driver_version) + ", toolkit " +
                               CudaVersionText(gpus.toolkit_version);
  std::vector<std::vector<std::string>> rows;
  rows.push_back({"cuda", gpus.devices.empty()
                              ? "not available: " + OneLine(gpus.reason) + " (" + versions + ")"
                              : versions});
  for (const CudaDevice& device : gpus.devices) {
    std::string text = device.name.empty() ? "" : device.Describe();
    if (!device.why_not.empty()) {
      text += (text.empty() ? "" : ": ") + std::string("not available: ") + OneLine(device.why_not);
    }
    rows.push_back({"GPU " + std::to_string(device.idx), text});
  }
  return rows;
}

Json ToJson(const std::vector<CudaDevice>& devices) {
  Json list = Json::array();
  for (const CudaDevice& device : devices) {
    const bool known = !device.name.empty();  // else it did not answer
    list.push_back({{"index", device.idx},
                    {"name", known ? Json(device.name) : Json()},
                    {"architecture", known ? Json(device.architecture()) : Json()},
                    {"memory_bytes", known ? Json(device.memory_bytes) : Json()},
                    {"available", device.why_not.empty()},
                    {"reason", device.why_not.empty() ? Json() : Json(device.why_not)}});
  }
  return list;
}

}  // namespace sherd::cli
