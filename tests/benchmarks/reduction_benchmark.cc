// Time and memory of reducing a large cloud: a wavy sheet of generated points, prepared and reduced
// in each of the ways there are.
//
//   sherd_reduction_benchmark [--points 10M] [--target 252k] [--nested] [--json FILE]
//
// Memory is the growth of the process's peak over what it held when the step began, beside the
// bytes of the survey's points.
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "metaball/stopwatch.h"
#include "reconstruction/level.h"
#include "reconstruction/reduction.h"
#include "tests/benchmarks/benchmark_main.h"

namespace sherd {
namespace {

// A figure of /proc/self/status in bytes; Linux only.
std::uint64_t StatusBytes(const std::string& key) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(key, 0) == 0) return 1024 * std::stoull(line.substr(key.size() + 1));
  }
  return 0;
}

struct Cost {
  double seconds = 0;
  std::uint64_t bytes = 0;
};

template <class Step>
Cost Measure(const Step& step) {
  malloc_trim(0);                                 // what was freed does not hide what is taken
  std::ofstream("/proc/self/clear_refs") << "5";  // the peak begins here
  const std::uint64_t before = StatusBytes("VmRSS:");
  const Stopwatch watch;
  step();
  Cost cost;
  cost.seconds = watch.Seconds();
  const std::uint64_t peak = StatusBytes("VmHWM:");
  cost.bytes = peak > before ? peak - before : 0;
  return cost;
}

Survey WavySheet(std::uint64_t n) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> gauss;
  Survey s;
  SurveyPoints& p = s.points;
  p.position.reserve(n);
  p.color.reserve(n);
  p.normal.reserve(n);
  const double noise = 0.2 / std::sqrt(static_cast<double>(n));
  for (std::uint64_t i = 0; i < n; ++i) {
    const double x = 2 * uniform(random), y = uniform(random);
    p.position.push_back({x, y, 0.05 * std::sin(6 * x) * std::cos(5 * y) + noise * gauss(random)});
    p.color.push_back({100, 120, 140});
    p.normal.push_back(Normalized(Vec3d{-0.3 * std::cos(6 * x) * std::cos(5 * y),
                                        0.25 * std::sin(6 * x) * std::sin(5 * y), 1})
                           .cast<float>());
  }
  return s;
}

int Run(int argc, char** argv) {
  std::string count = "10M", target = "252k", json;
  bool nested = false;
  CLI::App app("Time and memory of reducing a large cloud");
  app.add_option("--points", count, "points of the generated cloud");
  app.add_option("--target", target, "metaballs wanted");
  app.add_flag("--nested", nested, "nested levels as well");
  app.add_option("--json", json, "write the figures here");
  CLI11_PARSE(app, argc, argv);

  Survey survey = WavySheet(ParseCount(count));
  const std::size_t source_points = survey.points.size(), bytes = survey.points.MemoryBytes();
  const auto input = static_cast<double>(bytes);
  nlohmann::json steps = nlohmann::json::array();
  const auto report = [&](const std::string& name, const Cost& cost) {
    std::printf("%-28s %7.2f s  %6.0f MiB = %3.0f %% of the points\n", name.c_str(), cost.seconds,
                static_cast<double>(cost.bytes) / 1048576, 100 * double(cost.bytes) / input);
    std::fflush(stdout);
    steps.push_back({{"step", name},
                     {"seconds", cost.seconds},
                     {"peak_bytes", cost.bytes},
                     {"share_of_input", static_cast<double>(cost.bytes) / input}});
  };
  PreparedPoints points;
  report("prepare",
         Measure([&] { points = PreparePoints(std::move(survey.points), survey, true); }));
  report("smooth the noise", Measure([&] { SmoothNoise(true, &points); }));
  LevelOptions options;
  options.target_count = ParseCount(target);
  for (const std::string& name : ReductionNames()) {
    options.reduction = *FindReduction(name);
    report("reduce, " + name, Measure([&] { ReducePoints(points, options); }));
    report("level, " + name, Measure([&] { BuildLevel(points, survey, options); }));
    if (nested && options.reduction != Reduction::kVoxel) {
      report("order, " + name, Measure([&] { OrderPoints(options.reduction, &points); }));
      options.nested = true;
      report("level, nested, " + name, Measure([&] { BuildLevel(points, survey, options); }));
      options.nested = false;
    }
  }
  benchmarks::WriteJson(json, nlohmann::json{{"points", source_points},
                                             {"input_bytes", bytes},
                                             {"target", options.target_count},
                                             {"steps", std::move(steps)}});
  return 0;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  return sherd::benchmarks::RunMain("sherd_reduction_benchmark", sherd::Run, argc, argv);
}
