// Time and memory of giving every point of a survey its colour from the original photographs.
//
//   sherd_photo_color_benchmark WORKSPACE [--memory 1024] [--repeat 3] [--json F]
//
// docs/fidelity.md has the figures.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "reconstruction/level.h"
#include "reconstruction/photo_colors.h"
#include "reconstruction/workspace.h"
#include "tests/benchmarks/benchmark_main.h"

namespace sherd::benchmarks {
namespace {

double PeakMib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

int Run(int argc, char** argv) {
  std::string workspace, json;
  PhotoColorOptions options;
  int repeat = 3;
  CLI::App app("Colours of all points from the original photographs");
  app.add_option("workspace", workspace, "COLMAP workspace with a dense cloud")->required();
  app.add_option("--memory", options.memory_mb, "MiB");
  app.add_option("--repeat", repeat, "times")->check(CLI::Range(1, 100));
  app.add_option("--json", json, "write the figures here");
  CLI11_PARSE(app, argc, argv);

  const Survey survey = LoadSurvey(InspectWorkspace(workspace), {});
  for (std::uint32_t i = 0; i < survey.photographs.size(); ++i) {
    if (survey.photographs[i].original_path.empty()) options.leave_out.push_back(i);
  }
  LevelOptions level_options;
  level_options.target_count = survey.points.size();
  Level level = BuildLevel(PreparePoints(survey, false), survey, level_options);
  const double before = PeakMib();
  std::vector<double> seconds;
  PhotoColorStats stats;
  for (int i = 0; i < repeat; ++i) {
    stats = ColorFromPhotographs(survey, options, &level);
    seconds.push_back(stats.seconds);
  }
  std::sort(seconds.begin(), seconds.end());
  const double median = seconds[seconds.size() / 2];
  std::printf(
      "%zu metaballs, %llu coloured, %llu looks into %llu photographs: %.2f s (median of %d, least "
      "%.2f); peak memory %.0f MiB, before %.0f MiB, budget %d MiB\n",
      level.cloud.size(), static_cast<unsigned long long>(stats.colored),
      static_cast<unsigned long long>(stats.samples),
      static_cast<unsigned long long>(stats.photos_used), median, repeat, seconds.front(),
      PeakMib(), before, options.memory_mb);
  WriteJson(json, nlohmann::ordered_json{{"metaballs", level.cloud.size()},
                                         {"colored", stats.colored},
                                         {"samples", stats.samples},
                                         {"photographs", stats.photos_used},
                                         {"seconds", seconds},
                                         {"seconds_median", median},
                                         {"peak_mib", PeakMib()},
                                         {"peak_before_mib", before},
                                         {"budget_mib", options.memory_mb}});
  return 0;
}

}  // namespace
}  // namespace sherd::benchmarks

int main(int argc, char** argv) {
  return sherd::benchmarks::RunMain("sherd_photo_color_benchmark", sherd::benchmarks::Run, argc,
                                    argv);
}
