// How far does the rendered surface of a density level lie from the truth of the synthetic
// excavation, and how rough is it? Seen through the workspace's own cameras.
//
//   sherd_surface_benchmark PROJECT.sherd [--levels 63k,252k] [--seed 1] [--max-side 800]
//                           [--step 3] [--json FILE]
//
// Of every step-th pixel in each direction that counts (excavation_views.h) and shows the level:
// the distance of the rendered surface point to the nearest true surface; its signed height over
// the true surface at the same pixel, in front positive; and the angle between the rendered
// normal and the true one, which is what the eye takes for roughness under a raking light.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "app/project/project.h"
#include "datasets_synthetic/excavation.h"
#include "metaball/parallel.h"
#include "metaball/renderer.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/excavation_views.h"

namespace sherd {
namespace {

struct Options {
  std::string project, json;
  std::vector<std::string> levels;
  std::uint32_t seed = 1;
  int max_side = 800, step = 3;
};

struct Samples {
  std::vector<double> distance_m, height_m, angle_deg;
  std::uint64_t missed = 0;

  void Append(const Samples& other) {
    const auto append = [](std::vector<double>* to, const std::vector<double>& from) {
      to->insert(to->end(), from.begin(), from.end());
    };
    append(&distance_m, other.distance_m);
    append(&height_m, other.height_m);
    append(&angle_deg, other.angle_deg);
    missed += other.missed;
  }
};

Samples Compare(const Excavation& truth, const std::vector<Camera>& cameras, std::size_t own,
                const Frame& frame, int step) {
  const Camera& camera = cameras[own];
  std::vector<Samples> rows(static_cast<std::size_t>((camera.height + step - 1) / step));
  ParallelFor(static_cast<std::int64_t>(rows.size()), 0, [&](std::int64_t row, int) {
    Samples& out = rows[static_cast<std::size_t>(row)];
    const std::int64_t y = row * step;
    for (int x = 0; x < camera.width; x += step) {
      const RayD ray = RayThrough(camera, x + 0.5, static_cast<double>(y) + 0.5);
      TruthHit hit;
      if (!SurveyedTruthAt(truth, cameras, own, ray, &hit)) continue;
      const std::size_t pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
          static_cast<std::size_t>(x);
      const double depth = frame.depth[pixel];
      if (!(depth > 0)) {
        ++out.missed;
        continue;
      }
      out.distance_m.push_back(truth.SurfaceDistance(ray.origin + ray.direction * depth));
      out.height_m.push_back((depth - hit.distance) * Dot(ray.direction, hit.normal));
      const double cosine = Dot(Normalized(frame.normal[pixel].cast<double>()), hit.normal);
      out.angle_deg.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi);
    }
  });
  Samples all;
  for (const Samples& row : rows) all.Append(row);
  return all;
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const auto at = values.begin() +
                  static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

nlohmann::json Measure(const Project& project, const Survey& survey, const Excavation& truth,
                       const std::vector<Camera>& cameras, const std::string& name, int step) {
  const auto level = project.LoadLevel(name);
  Scene scene;
  scene.cloud = std::shared_ptr<const Cloud>(level, &level->cloud);
  scene.surface.threshold = level->stats.threshold;
  auto renderer = MakeCpuRenderer();
  Samples all;
  double seconds = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    RenderSettings settings;
    settings.planes.depth = settings.planes.normal = true;
    const Frame frame = renderer->Render(scene, cameras[i], settings);
    seconds += frame.stats.seconds_total;
    all.Append(Compare(truth, cameras, i, frame, step));
  }
  const double unit = survey.metres_per_unit.value_or(1.0);
  const nlohmann::json out = {{"level", name},
                              {"metaballs", level->cloud.size()},
                              {"spacing_m", level->stats.spacing * unit},
                              {"samples", all.distance_m.size()},
                              {"missed", all.missed},
                              {"distance_mean_m", Mean(all.distance_m)},
                              {"distance_p95_m", Quantile(all.distance_m, 0.95)},
                              {"distance_max_m", Quantile(all.distance_m, 1.0)},
                              {"height_median_m", Quantile(all.height_m, 0.5)},
                              {"angle_mean_deg", Mean(all.angle_deg)},
                              {"angle_median_deg", Quantile(all.angle_deg, 0.5)},
                              {"build_seconds", level->stats.seconds},
                              {"render_seconds", seconds}};
  std::printf(
      "%-6s %8zu metaballs  distance mean %.3f mm, 95 %% %.3f mm, largest %.1f mm  "
      "height %+.3f mm  normals %.2f deg (median %.2f)  missed %llu\n",
      name.c_str(), level->cloud.size(), 1e3 * out["distance_mean_m"].get<double>(),
      1e3 * out["distance_p95_m"].get<double>(), 1e3 * out["distance_max_m"].get<double>(),
      1e3 * out["height_median_m"].get<double>(), out["angle_mean_deg"].get<double>(),
      out["angle_median_deg"].get<double>(), static_cast<unsigned long long>(all.missed));
  std::fflush(stdout);
  return out;
}

int Run(int argc, char** argv) {
  Options options;
  CLI::App app("Distance of a level's rendered surface to the true one");
  app.add_option("project", options.project, "project made from sherd-synthetic's workspace")
      ->required();
  app.add_option("--levels", options.levels, "density levels (default: all)")->delimiter(',');
  app.add_option("--seed", options.seed, "the seed the excavation was made with");
  app.add_option("--max-side", options.max_side, "pixels of the longer side of each view");
  app.add_option("--step", options.step, "every so many pixels are compared, each way")
      ->check(CLI::PositiveNumber);
  app.add_option("--json", options.json, "write the figures here");
  CLI11_PARSE(app, argc, argv);

  const Project project = Project::Open(options.project);
  if (options.levels.empty()) {
    for (const LevelEntry& level : project.levels()) options.levels.push_back(level.name);
  }
  const auto survey = project.LoadSurveyFromCache();
  const Excavation truth(options.seed);
  const std::vector<Camera> cameras = PhotographCameras(*survey, options.max_side);
  nlohmann::json all = nlohmann::json::array();
  for (const std::string& level : options.levels) {
    all.push_back(Measure(project, *survey, truth, cameras, level, options.step));
  }
  benchmarks::WriteJson(options.json, all);
  return 0;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  return sherd::benchmarks::RunMain("sherd_surface_benchmark", sherd::Run, argc, argv);
}
