// sherd devices: what can render on this machine, and why something cannot.
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/command.h"
#include "app/cli/table.h"
#include "cuda/renderers.h"

namespace sherd::cli {
namespace {

int RunDevices(bool json) {
  const std::unique_ptr<Renderer> cpu = MakeCpuRenderer();
  const CudaStatus cuda = QueryCuda();
  std::string chosen_why;
  const std::string chosen = MakeRenderer(Backend::kAuto, &chosen_why)->backend();
  if (json) {
    PrintJson({{"auto", chosen},
               {"note", chosen_why},
               {"backends",
                {{{"backend", "cpu"}, {"available", true}, {"device", cpu->device()}},
                 {{"backend", "cuda"},
                  {"available", cuda.available},
                  {"device", cuda.available ? Json(cuda.device) : Json()},
                  {"reason", cuda.available ? Json() : Json(cuda.reason)}}}}});
    return kSuccess;
  }
  Print(Table({{"cpu", cpu->device()},
               {"cuda", cuda.available ? cuda.device : "not available: " + OneLine(cuda.reason)},
               {"auto", chosen}},
              0, {1}));
  return kSuccess;
}

}  // namespace

void AddDevices(CLI::App* program, Action* action) {
  auto json = std::make_shared<bool>(false);
  CLI::App* app =
      program->add_subcommand("devices", "Say what can render on this machine, and why not.");
  app->add_flag("--json", *json, "print JSON");
  app->footer(
      "Examples:\n"
      "  sherd devices\n"
      "  sherd devices --json");
  app->callback(
      [json, action] { *action = [json](const Environment&) { return RunDevices(*json); }; });
}

}  // namespace sherd::cli
