// sherd devices: what can render on this machine, and why something cannot.
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/command.h"
#include "app/cli/device_list.h"
#include "app/cli/table.h"
#include "cuda/device_query.h"
#include "cuda/renderers.h"

namespace sherd::cli {
namespace {

Json VersionOrNull(int version) { return version ? Json(CudaVersionText(version)) : Json(); }

int RunDevices(bool json) {
  const std::unique_ptr<Renderer> cpu = MakeCpuRenderer();
  GpuList gpus = ListGpus();
  for (CudaDevice& device : gpus.devices) device.why_not = WhyUnusable(device);
  const CudaStatus cuda = QueryCuda();
  std::string chosen_why;
  const std::unique_ptr<Renderer> chosen = MakeRenderer({}, &chosen_why);
  const int chosen_gpu = chosen->gpu();
  if (json) {
    PrintJson({{"auto", chosen->backend()},
               {"auto_gpu", chosen_gpu == Renderer::kNoGpu ? Json() : Json(chosen_gpu)},
               {"note", chosen_why},
               {"backends",
                {{{"backend", "cpu"}, {"available", true}, {"device", cpu->device()}},
                 {{"backend", "cuda"},
                  {"available", cuda.available},
                  {"device", cuda.available ? Json(cuda.device) : Json()},
                  {"reason", cuda.available ? Json() : Json(cuda.reason)}}}},
               {"gpus", ToJson(gpus.devices)},
               {"cuda_driver", VersionOrNull(gpus.driver_version)},
               {"cuda_toolkit", VersionOrNull(gpus.toolkit_version)}});
    return kSuccess;
  }
  std::vector<std::vector<std::string>> rows = {{"cpu", cpu->device()}};
  for (std::vector<std::string>& row : DeviceRows(gpus)) rows.push_back(std::move(row));
  rows.push_back(
      {"auto", chosen_gpu == Renderer::kNoGpu ? "cpu" : "GPU " + std::to_string(chosen_gpu)});
  Print(Table(rows, 0, {1}));
  return kSuccess;
}

}  // namespace

void AddDevices(CLI::App* program, Action* action) {
  auto json = std::make_shared<bool>(false);
  CLI::App* app = program->add_subcommand(
      "devices", "Say what can render on this machine, each GPU by its number, and why not.");
  app->add_flag("--json", *json, "print JSON");
  app->footer(
      "Examples:\n"
      "  sherd devices\n"
      "  sherd devices --json");
  app->callback(
      [json, action] { *action = [json](const Environment&) { return RunDevices(*json); }; });
}

}  // namespace sherd::cli
