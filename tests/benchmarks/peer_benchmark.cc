// Speed and error on the two scenes every renderer can draw (docs/performance.md): Sherd's CPU
// renderer, both paths, beside POV-Ray in the same run, all against the double-precision reference.
//
//   sherd_peer_benchmark [--sizes 63000,250000] [--threads 2] [--repeat 5] [--no-povray]
//                        [--no-reference] [--json FILE]
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "metaball/cpu_renderer.h"
#include "metaball/frame_difference.h"
#include "povray.h"
#include "tests/benchmarks/benchmark_main.h"

namespace sherd {
namespace {

struct Options {
  std::vector<std::uint64_t> sizes{63000, 250000};
  int threads = 2;
  int repeat = 5;
  bool povray = true, reference = true;
  std::string json;
};

// Pixels of POV-Ray's picture off by more than 8/255 from the reference.
std::uint64_t CountOff(const PovRayRun& run, const ReferenceFrame& reference) {
  std::uint64_t off = 0;
  for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
    const ReferenceHit& hit = reference.pixels[i];
    if (hit.grazing) continue;
    const double expected[3] = {hit.color.x, hit.color.y, hit.color.z};
    for (int c = 0; c < 3; ++c) {
      if (std::abs(run.rgb[3 * i + c] - 255 * expected[c]) > 8.5) {
        ++off;
        break;
      }
    }
  }
  return off;
}

nlohmann::json Measure(const std::string& name, const PeerScene& peer, const Options& options) {
  nlohmann::json row;
  row["scene"] = name;
  row["metaballs"] = peer.scene.cloud->size();
  std::cout << "\n"
            << name << ", " << peer.scene.cloud->size() << " metaballs, " << peer.camera.width
            << "x" << peer.camera.height << ", " << options.threads << " threads\n";
  ReferenceFrame reference;
  if (options.reference) reference = ReferenceRender(peer.scene, peer.camera, options.threads);

  double ours = 0;
  for (const CpuPath path : {CpuPath::kScalar, CpuPath::kBest}) {
    auto renderer = MakeCpuRenderer(path);
    RenderSettings settings;
    settings.threads = options.threads;
    std::vector<double> totals, bins;
    Frame frame;
    for (int i = 0; i < options.repeat; ++i) {
      frame = renderer->Render(peer.scene, peer.camera, settings);
      totals.push_back(frame.stats.seconds_total);
      bins.push_back(frame.stats.seconds_bin);
    }
    std::sort(totals.begin(), totals.end());
    std::sort(bins.begin(), bins.end());
    const double median = totals[totals.size() / 2];
    if (path == CpuPath::kBest) ours = median;
    nlohmann::json entry{{"device", frame.stats.device},
                         {"seconds_total_median", median},
                         {"seconds_total_min", totals.front()},
                         {"seconds_total_max", totals.back()},
                         {"seconds_bin_median", bins[bins.size() / 2]},
                         {"rays_per_second", static_cast<double>(frame.stats.rays) / median},
                         {"cloud_bytes", peer.scene.cloud->MemoryBytes()},
                         {"working_bytes", frame.stats.bytes}};
    std::printf("  sherd %-22s %7.1f ms (binning %5.1f)  %6.2f Mray/s  working memory %.1f MB\n",
                frame.stats.device.c_str(), 1e3 * median, 1e3 * bins[bins.size() / 2],
                1e-6 * static_cast<double>(frame.stats.rays) / median,
                1e-6 * static_cast<double>(frame.stats.bytes));
    if (options.reference) {
      settings.planes = {true, true, false};
      frame = renderer->Render(peer.scene, peer.camera, settings);
      const FrameDifference d = CompareToReference(frame, reference, peer.scene.cloud->frame.unit);
      std::printf("    %s\n", d.Describe().c_str());
      entry["error"] = {{"missed", d.missed},
                        {"invented", d.invented},
                        {"color_off_by_8", d.color_off},
                        {"grazing_left_out", d.grazing},
                        {"depth_radii_median", d.depth_median},
                        {"depth_radii_p99", d.depth_p99},
                        {"depth_radii_max", d.depth_max},
                        {"normal_deg_max", d.normal_max_deg}};
    }
    row[path == CpuPath::kBest ? "best" : "scalar"] = entry;
  }
  if (options.povray) {
    if (const auto run = RenderWithPovRay(peer, options.threads)) {
      std::printf("  POV-Ray parse %.1f s, trace %.2f s, %.0f MB; trace / sherd total = %.1f\n",
                  run->seconds_parse, run->seconds_trace, run->peak_mb, run->seconds_trace / ours);
      row["povray"] = {{"seconds_parse", run->seconds_parse},
                       {"seconds_trace", run->seconds_trace},
                       {"seconds_wall", run->seconds_wall},
                       {"peak_mb", run->peak_mb},
                       {"trace_over_sherd_total", run->seconds_trace / ours}};
      if (options.reference) {
        const std::uint64_t off = CountOff(*run, reference);
        std::printf("    pixels off by more than 8/255: %llu\n",
                    static_cast<unsigned long long>(off));
        row["povray"]["off_by_8"] = off;
      }
    }
  }
  return row;
}

int Run(int argc, char** argv) {
  Options options;
  CLI::App app("Sherd's CPU renderer beside POV-Ray on the two peer scenes");
  app.add_option("--sizes", options.sizes, "numbers of metaballs")->delimiter(',');
  app.add_option("--threads", options.threads, "threads for every program");
  app.add_option("--repeat", options.repeat, "runs of each of Sherd's renderers; the median counts")
      ->check(CLI::Range(1, 1000));
  app.add_flag("!--no-povray", options.povray, "leave POV-Ray out");
  app.add_flag("!--no-reference", options.reference, "leave the errors out");
  app.add_option("--json", options.json, "write the figures here");
  CLI11_PARSE(app, argc, argv);

  nlohmann::json rows = nlohmann::json::array();
  for (const std::uint64_t size : options.sizes) {
    rows.push_back(Measure("height field", MakeHeightField(size), options));
    rows.push_back(Measure("shell", MakeShell(size), options));
  }
  benchmarks::WriteJson(options.json, nlohmann::json{{"threads", options.threads}, {"rows", rows}});
  return 0;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  return sherd::benchmarks::RunMain("sherd_peer_benchmark", sherd::Run, argc, argv);
}
