// Whether compensated sums pay: the error of the field's sums in floats, in compensated floats and
// in doubles against the double-precision reference, and what each costs, where sums lose digits
// (docs/accuracy.md).
//
//   sherd_sum_benchmark [--repeat 5] [--json FILE]
#include <CLI/CLI.hpp>
#include <algorithm>
#include <climits>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "datasets_synthetic/random.h"
#include "metaball/frame_difference.h"
#include "metaball/frame_work.h"
#include "metaball/renderer.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"
#include "metaball/tile_binning.h"
#include "sum_tracers.h"
#include "tests/benchmarks/benchmark_main.h"

namespace sherd {
namespace {

struct Case {
  std::string name;
  Scene scene;
  Camera camera;
};

// n values of p(i) with radii r(i).
CloudInput Points(int n, const std::function<Vec3d(int)>& p, const std::function<double(int)>& r) {
  CloudInput input;
  for (int i = 0; i < n; ++i) {
    input.center.push_back(p(i));
    input.radius.push_back(r(i));
  }
  return input;
}

// share: of the field at the origin.
Scene AtShare(const CloudInput& input, double share, const char* density = "murakami") {
  Scene scene;
  scene.cloud = std::make_shared<Cloud>(BuildCloud(input));
  scene.surface.density = ParseDensity(density);
  scene.surface.threshold =
      share * ReferenceField(scene, scene.cloud->frame.LocalFromWorld({0, 0, 0}));
  return scene;
}

// A picture that a sphere of the radius half fills.
Camera Around(double radius, int width, int height) {
  return Camera::LookAt({0.3 * radius, 0.5 * radius, -5 * radius}, {0, 0, 0}, {0, 1, 0}, 0.5, width,
                        height);
}

// Where (1 - x^2)^2 has fallen to the share.
double RadiusAt(double share) { return std::sqrt(1 - std::sqrt(share)); }

std::vector<Case> MakeCases() {
  std::vector<Case> cases;
  synthetic::Rng random(1);
  const auto in_cell = [&](int) {
    return Vec3d{random.Uniform(-1e-3, 1e-3), random.Uniform(-1e-3, 1e-3),
                 random.Uniform(-1e-3, 1e-3)};
  };
  const auto one_place = [](int) { return Vec3d{1e-3, 2e-3, 3e-3}; };
  const auto unit = [](int) { return 1.0; };
  const auto mixed = [&](int) { return std::pow(50.0, -random.Uniform()); };
  for (const double share : {0.2, 0.9, 0.999, 0.99999}) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", share);
    const auto add = [&](const char* what, const CloudInput& input, int width, int height) {
      cases.push_back({std::string(what) + ", threshold at " + text + " of the sum",
                       AtShare(input, share), Around(RadiusAt(share), width, height)});
    };
    add("1e4 at one place", Points(10000, one_place, unit), 12, 8);
    add("1e5 in one cell", Points(100000, in_cell, unit), 4, 3);
    if (share == 0.999) {
      add("1e6 at one place", Points(1000000, one_place, unit), 2, 1);
      add("1e6 in one cell", Points(1000000, in_cell, unit), 2, 1);
    }
  }
  // Radii of 1 to 1/50: the large ones' sum, and the small ones that make the surface.
  cases.push_back({"5e4 in one cell, radii of 1 to 50", AtShare(Points(50000, in_cell, mixed), 0.5),
                   Around(0.3, 6, 4)});
  // The sum of the terms' sizes is hundreds of times the threshold.
  const auto ball = [&](int) {
    for (;;) {
      const Vec3d p{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)};
      if (Dot(p, p) <= 1) return p * 0.4;
    }
  };
  Case lobes{"2e4 with negative lobes that cancel",
             AtShare(Points(20000, ball, unit), 1, "trigonometric:7.853981633974483,1"),
             Around(1.2, 6, 4)};
  lobes.scene.surface.threshold = 20;
  cases.push_back(lobes);
  // Rims alone: every term is at most some thousandths, and the surface lies in the hollow.
  const auto shell = [&](int) {
    for (;;) {
      const Vec3d p = ball(0);
      if (Length(p) > 0.1) return Normalized(p) * 0.95;
    }
  };
  cases.push_back({"1e5 weak ones around a hollow", AtShare(Points(100000, shell, unit), 1.001),
                   Camera::LookAt({0, 0, 0}, {0.3, 0.2, 1}, {0, 1, 0}, 2.0, 4, 3)});
  return cases;
}

// A frame's tiles, one after another on this thread.
Frame Draw(const Case& what, const TileBins& bins, Sums sums, double* seconds) {
  Frame frame = MakeFrame(what.camera, {.depth = true, .normal = true, .id = true});
  TraceJob job = JobOf(what.scene, what.camera, &bins, &frame);
  job.float_overlap = INT_MAX;  // floats are what is measured
  TraceCounts counts;
  const Stopwatch watch;
  for (int tile = 0; tile < bins.tiles_x() * bins.tiles_y(); ++tile) {
    if (bins.count(tile) > 0) TraceWithSums(job, sums, tile, &counts);
  }
  *seconds = watch.Seconds();
  AddCounts(counts, &frame.stats);
  return frame;
}

nlohmann::json Measure(const Case& what, int repeat) {
  const Scene& scene = what.scene;
  const ReferenceFrame reference = ReferenceRender(scene, what.camera);
  TileBins bins;
  RenderStats unused;
  BinMetaballs(JobOf(scene, what.camera, &bins, nullptr), 0, {}, &bins, &unused);
  std::printf("%s\n", what.name.c_str());
  constexpr const char* kNames[] = {"floats", "compensated floats", "doubles"};
  constexpr Sums kSums[] = {Sums::kPlain, Sums::kCompensated, Sums::kDouble};
  std::vector<double> seconds[3];
  Frame frames[3];
  for (int i = 0; i <= repeat; ++i) {  // by turns; the first is not counted
    for (int k = 0; k < 3; ++k) {
      double once = 0;
      frames[k] = Draw(what, bins, kSums[k], &once);
      if (i > 0) seconds[k].push_back(once);
    }
  }
  nlohmann::json rows = nlohmann::json::array();
  for (int k = 0; k < 3; ++k) {
    std::sort(seconds[k].begin(), seconds[k].end());
    const double median = seconds[k][seconds[k].size() / 2];
    const FrameDifference d = CompareToReference(frames[k], reference, scene.cloud->frame.unit);
    std::printf(
        "  %-20s %9.3f ms  hits %llu missed %llu invented %llu  depth p50 %.1e max %.1e  "
        "normal max %.1e deg\n",
        kNames[k], 1e3 * median, static_cast<unsigned long long>(frames[k].stats.hits),
        static_cast<unsigned long long>(d.missed), static_cast<unsigned long long>(d.invented),
        d.depth_median, d.depth_max, d.normal_max_deg);
    rows.push_back({{"case", what.name},
                    {"sums", kNames[k]},
                    {"milliseconds", 1e3 * median},
                    {"pixels", d.pixels},
                    {"hits", frames[k].stats.hits},
                    {"missed", d.missed},
                    {"invented", d.invented},
                    {"depth_radii_median", d.depth_median},
                    {"depth_radii_max", d.depth_max},
                    {"normal_deg_max", d.normal_max_deg},
                    {"grazing", frames[k].stats.grazing},
                    {"unresolved", frames[k].stats.unresolved}});
  }
  std::fflush(stdout);
  return rows;
}

int Run(int argc, char** argv) {
  int repeat = 5;
  std::string json;
  CLI::App app("Plain, compensated and double sums of the field, where sums lose digits");
  app.add_option("--repeat", repeat, "runs of each; the median counts")->check(CLI::Range(1, 1000));
  app.add_option("--json", json, "write the figures here");
  CLI11_PARSE(app, argc, argv);
  nlohmann::json rows = nlohmann::json::array();
  for (const Case& what : MakeCases()) {
    for (auto& row : Measure(what, repeat)) rows.push_back(row);
  }
  benchmarks::WriteJson(json, nlohmann::json{{"repeat", repeat}, {"rows", rows}});
  return 0;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  return sherd::benchmarks::RunMain("sherd_sum_benchmark", sherd::Run, argc, argv);
}
