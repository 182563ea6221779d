// Holes: of the pixels in which the true surface of the synthetic excavation is visible, how many
// does the render of a density level miss? Seen through the workspace's own cameras.
//
//   sherd_hole_benchmark PROJECT.sherd --level 63k [--seed 1] [--max-side 800] [--json FILE]
//
// A pixel counts where the truth has a surface that at least one other photograph sees as well (no
// reconstruction can hold what only one photograph saw), inside the surveyed area. It is missed
// when the render shows nothing there, or something more than `--through` metres behind the true
// surface.
#include <CLI/CLI.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "app/project/project.h"
#include "datasets_synthetic/excavation.h"
#include "metaball/parallel.h"
#include "metaball/renderer.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/excavation_views.h"

namespace sherd {
namespace {

struct Options {
  std::string project, level = "63k", json;
  std::uint32_t seed = 1;
  int max_side = 800;
  double through_m = 0.10;
};

struct Counts {
  std::uint64_t visible = 0, empty = 0, through = 0;
};

Counts CountHoles(const Excavation& truth, const std::vector<Camera>& cameras, std::size_t own,
                  const Frame& frame, double through_m) {
  const Camera& camera = cameras[own];
  std::vector<Counts> rows(camera.height);
  ParallelFor(camera.height, 0, [&](std::int64_t y, int) {
    for (int x = 0; x < camera.width; ++x) {
      const RayD ray = RayThrough(camera, x + 0.5, static_cast<double>(y) + 0.5);
      TruthHit hit;
      if (!SurveyedTruthAt(truth, cameras, own, ray, &hit)) continue;
      ++rows[y].visible;
      const float depth = frame.depth[static_cast<std::size_t>(y) * camera.width + x];
      if (depth == 0.0f) {
        ++rows[y].empty;
      } else if (depth > hit.distance + through_m) {
        ++rows[y].through;
      }
    }
  });
  Counts sum;
  for (const Counts& row : rows) {
    sum.visible += row.visible;
    sum.empty += row.empty;
    sum.through += row.through;
  }
  return sum;
}

int Run(int argc, char** argv) {
  Options options;
  CLI::App app("Share of the truly visible surface that a level's render misses");
  app.add_option("project", options.project, "project made from sherd-synthetic's workspace")
      ->required();
  app.add_option("--level", options.level, "density level");
  app.add_option("--seed", options.seed, "the seed the excavation was made with");
  app.add_option("--max-side", options.max_side, "pixels of the longer side of each view");
  app.add_option("--through", options.through_m, "metres behind the truth that count as a hole");
  app.add_option("--json", options.json, "write the figures here");
  CLI11_PARSE(app, argc, argv);

  const Project project = Project::Open(options.project);
  const auto survey = project.LoadSurveyFromCache();
  const auto level = project.LoadLevel(options.level);
  const Excavation truth(options.seed);
  Scene scene;
  scene.cloud = std::shared_ptr<const Cloud>(level, &level->cloud);
  scene.surface.threshold = level->stats.threshold;
  const std::vector<Camera> cameras = PhotographCameras(*survey, options.max_side);
  auto renderer = MakeCpuRenderer();
  Counts total;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    RenderSettings settings;
    settings.planes.depth = true;
    const Frame frame = renderer->Render(scene, cameras[i], settings);
    const Counts counts = CountHoles(truth, cameras, i, frame, options.through_m);
    std::printf("%-24s visible %8llu  empty %6llu  seen through %6llu\n",
                survey->photographs[i].name.c_str(),
                static_cast<unsigned long long>(counts.visible),
                static_cast<unsigned long long>(counts.empty),
                static_cast<unsigned long long>(counts.through));
    total.visible += counts.visible;
    total.empty += counts.empty;
    total.through += counts.through;
  }
  const double share = static_cast<double>(total.empty + total.through) /
                       static_cast<double>(std::max<std::uint64_t>(1, total.visible));
  std::printf("level %s: %llu metaballs, visible %llu, missed %llu = %.4f %%\n",
              options.level.c_str(), static_cast<unsigned long long>(level->cloud.size()),
              static_cast<unsigned long long>(total.visible),
              static_cast<unsigned long long>(total.empty + total.through), 100 * share);
  benchmarks::WriteJson(options.json, nlohmann::json{{"level", options.level},
                                                     {"metaballs", level->cloud.size()},
                                                     {"visible", total.visible},
                                                     {"empty", total.empty},
                                                     {"through", total.through},
                                                     {"missed_share", share}});
  return 0;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  return sherd::benchmarks::RunMain("sherd_hole_benchmark", sherd::Run, argc, argv);
}
