// Holes: of the pixels in which the true surface of the synthetic excavation is visible, how many
// does the render of a density level miss? Seen through the workspace's own cameras.
//
//   sherd_hole_benchmark PROJECT.sherd --level 63k [--seed 1] [--max-side 800] [--json FILE]
//
// A pixel counts where the truth has a surface that at least one other photograph sees as well (no
// reconstruction can hold what only one photograph saw), inside the surveyed area. It is missed
// when the render shows nothing there, or something more than `--through` metres behind the true
// surface. A missed pixel is
//   bare     where the survey has no point within a spacing of the level: no level can cover it;
//   outline  else, where what is missed is thinner than three pixels: the rim of something in front
//            of something else;
//   a gap    else.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/project/project.h"
#include "datasets_synthetic/excavation.h"
#include "metaball/parallel.h"
#include "metaball/renderer.h"
#include "reconstruction/level.h"
#include "reconstruction/neighbors.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/excavation_views.h"
#include "tests/benchmarks/picture_metrics.h"

namespace sherd {
namespace {

struct Options {
  std::string project, level = "63k", json;
  std::uint32_t seed = 1;
  int max_side = 800;
  double through_m = 0.10;
};

struct Counts {
  std::uint64_t visible = 0, empty = 0, through = 0;  // all missed ones: empty + through
  std::uint64_t bare = 0, outline = 0;                // of them

  std::uint64_t missed() const { return empty + through; }
  std::uint64_t gaps() const { return missed() - bare - outline; }
  Counts& operator+=(const Counts& c) {
    visible += c.visible;
    empty += c.empty;
    through += c.through;
    bare += c.bare;
    outline += c.outline;
    return *this;
  }
};

// What a reconstruction has to show: the truth and where the survey has points of it.
struct Wanted {
  const Excavation& truth;
  const std::vector<Camera>& cameras;
  const std::vector<Vec3d>& points;
  const NeighborSearch& search;  // among `points`
  double spacing = 0;            // of the level, metres
  double through = 0;            // metres
};

Counts CountHoles(const Wanted& wanted, std::size_t own, const Frame& frame) {
  const Camera& camera = wanted.cameras[own];
  const auto width = static_cast<std::size_t>(camera.width);
  std::vector<char> missed(frame.depth.size(), 0), bare(frame.depth.size(), 0);
  std::vector<Counts> rows(static_cast<std::size_t>(camera.height));
  ParallelFor(camera.height, 0, [&](std::int64_t y, int) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
      const RayD ray =
          RayThrough(camera, static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
      TruthHit hit;
      if (!SurveyedTruthAt(wanted.truth, wanted.cameras, own, ray, &hit)) continue;
      Counts& row = rows[static_cast<std::size_t>(y)];
      ++row.visible;
      const float depth = frame.depth[pixel];
      const bool empty = depth == 0.0f, through = depth > hit.distance + wanted.through;
      row.empty += empty;
      row.through += through;
      if (!empty && !through) continue;
      missed[pixel] = 1;
      const Vec3d place = ray.origin + ray.direction * hit.distance;
      const int nearest = wanted.search.NearestTo(place);
      bare[pixel] = nearest < 0 || Length(wanted.points[static_cast<std::size_t>(nearest)] -
                                          place) > wanted.spacing;
      row.bare += bare[pixel] != 0;
    }
  });
  Counts sum;
  for (const Counts& row : rows) sum += row;
  const std::vector<char> wide = benchmarks::Dilated(
      benchmarks::Eroded(missed, camera.width, camera.height, 1), camera.width, camera.height, 1);
  for (std::size_t i = 0; i < missed.size(); ++i) sum.outline += missed[i] && !bare[i] && !wide[i];
  return sum;
}

double Share(std::uint64_t count, const Counts& of) {
  return static_cast<double>(count) / static_cast<double>(std::max<std::uint64_t>(1, of.visible));
}

void Print(const std::string& name, const Counts& c) {
  const auto number = [](std::uint64_t v) { return static_cast<unsigned long long>(v); };
  std::printf(
      "%-24s visible %9llu  missed %6llu (%.4f %%): bare %6llu  outline %6llu  gaps %6llu (%.4f "
      "%%)\n",
      name.c_str(), number(c.visible), number(c.missed()), 100 * Share(c.missed(), c),
      number(c.bare), number(c.outline), number(c.gaps()), 100 * Share(c.gaps(), c));
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
  const PreparedPoints prepared = PreparePoints(*survey, true);
  const NeighborSearch search(prepared.points.position);
  const Wanted wanted{
      truth, cameras, prepared.points.position, search, level->stats.spacing, options.through_m};
  auto renderer = MakeCpuRenderer();
  Counts total;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    RenderSettings settings;
    settings.planes.depth = true;
    const Counts counts = CountHoles(wanted, i, renderer->Render(scene, cameras[i], settings));
    Print(survey->photographs[i].name, counts);
    total += counts;
  }
  Print("level " + options.level, total);
  benchmarks::WriteJson(options.json,
                        nlohmann::ordered_json{{"level", options.level},
                                               {"metaballs", level->cloud.size()},
                                               {"visible", total.visible},
                                               {"empty", total.empty},
                                               {"through", total.through},
                                               {"bare", total.bare},
                                               {"outline", total.outline},
                                               {"gaps", total.gaps()},
                                               {"missed_share", Share(total.missed(), total)},
                                               {"gap_share", Share(total.gaps(), total)}});
  return 0;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  return sherd::benchmarks::RunMain("sherd_hole_benchmark", sherd::Run, argc, argv);
}
