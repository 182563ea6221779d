#include "app/bench/stability.h"

#include <memory>
#include <utility>

#include "app/bench/contenders.h"
#include "app/project/format.h"
#include "datasets_synthetic/stiff_cases.h"
#include "metaball/cpu_renderer.h"

namespace sherd {
namespace {

struct Named {
  std::string name;
  std::unique_ptr<Renderer> renderer;
};

std::vector<Named> Backends(const DeviceChoice& choice) {
  std::vector<Named> backends;
  backends.push_back({"cpu, vectors", MakeCpuRenderer(CpuPath::kBest)});
  backends.push_back({"cpu, scalar", MakeCpuRenderer(CpuPath::kScalar)});
  if (auto gpu = MakeGpuRenderer(choice)) backends.push_back({"cuda", std::move(gpu)});
  return backends;
}

std::string OutcomeOf(const StiffCase& stiff, const StiffOutcome& outcome) {
  if (outcome.passed) return "passed";
  // A backend that says what it cannot draw has drawn nothing wrong.
  const bool refused = outcome.what.starts_with("refused: ");
  return refused && stiff.expect != StiffCase::Expect::kRefused ? "refused" : "failed";
}

}  // namespace

std::vector<StabilityRow> RunStability(const DeviceChoice& gpu, const Control& control) {
  const std::vector<StiffCase> cases = MakeStiffCases();
  const std::vector<Named> backends = Backends(gpu);
  std::vector<StabilityRow> rows;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const StiffCase& stiff = cases[i];
    control.ThrowIfStopped();
    control.Report(stiff.name, static_cast<double>(i) / static_cast<double>(cases.size()));
    const ReferenceFrame reference = MakeReference(stiff);
    for (const Named& backend : backends) {
      const StiffOutcome outcome = RunStiffCase(stiff, backend.renderer.get(), reference);
      rows.push_back({stiff.name, stiff.expects, backend.name, OutcomeOf(stiff, outcome),
                      outcome.what, outcome.error, outcome.stats});
    }
  }
  return rows;
}

FigureTable FiguresOf(const std::vector<StabilityRow>& rows) {
  FigureTable table;
  table.columns = {"case",           "expects", "backend",   "outcome",
                   "what",           "missed",  "invented",  "depth_radii_max",
                   "normal_deg_max", "grazing", "unresolved"};
  const auto count = [](std::uint64_t n) { return Figure{static_cast<double>(n)}; };
  for (const StabilityRow& row : rows) {
    // Only what was compared with the reference has errors.
    const bool compared = row.error.pixels > 0;
    table.rows.push_back({row.name, row.expects, row.backend, row.outcome, row.what,
                          compared ? count(row.error.missed) : Figure{},
                          compared ? count(row.error.invented) : Figure{},
                          compared ? Figure{row.error.depth_max} : Figure{},
                          compared ? Figure{row.error.normal_max_deg} : Figure{},
                          count(row.stats.grazing), count(row.stats.unresolved)});
  }
  return table;
}

std::vector<std::vector<std::string>> ScreenTable(const std::vector<StabilityRow>& rows) {
  std::vector<std::vector<std::string>> table = {{"case", "must come out", "backend", "", "missed",
                                                  "invented", "depth max", "normal max", "grazing",
                                                  "unresolved"}};
  for (const StabilityRow& row : rows) {
    const bool compared = row.error.pixels > 0;
    const auto only = [&](const std::string& text) { return compared ? text : std::string("-"); };
    table.push_back({row.name, row.expects, row.backend, row.outcome,
                     only(FormatGrouped(row.error.missed)), only(FormatGrouped(row.error.invented)),
                     only(FormatNumber(row.error.depth_max, 2)),
                     only(FormatNumber(row.error.normal_max_deg, 2)),
                     FormatGrouped(row.stats.grazing), FormatGrouped(row.stats.unresolved)});
  }
  return table;
}

}  // namespace sherd
