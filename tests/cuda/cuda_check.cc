// Every backend of this machine against the double-precision reference, scene by scene.
//
//   sherd_cuda_check [--json FILE] [--count N] [--size WxH] [--backend NAME]... [--scene TEXT]
//
// Backends: cpu, host-loop (the CUDA kernels' bodies run on the CPU), cuda where a GPU can be used.
// The thesis's method (thesis_check.h) is held against itself on the CPU.
// Needs a compiler and the toolkit, nothing else. Exits with 1 when a backend breaks the contract,
// 2 when a command line cannot be used.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "cuda/cuda_renderer.h"
#include "cuda/host_loop.h"
#include "cuda/photo_sampler.h"
#include "cuda/renderers.h"
#include "json_writer.h"
#include "metaball/atomic_file.h"
#include "metaball/frame_difference.h"
#include "metaball/photo/sampler.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"
#include "photo_scenes.h"
#include "scenes.h"
#include "thesis_check.h"

namespace sherd {
namespace {

struct Options {
  std::string json, scene;
  std::uint64_t count = 10000;
  int width = 160, height = 90;
  std::vector<std::string> backends;
};

struct Result {
  std::string scene, backend, device;
  FrameDifference difference;
  bool has_reference = true;       // a supersampled picture is compared with the CPU's
  std::uint64_t off_from_cpu = 0;  // pixels that differ by more than 8/255 from the CPU renderer's
  RenderStats stats;
  bool passed = true;
  std::string error;
};

Options ParseOptions(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (i + 1 == argc) throw std::invalid_argument(name + " needs a value");
    const std::string value = argv[++i];
    if (name == "--json") {
      options.json = value;
    } else if (name == "--scene") {
      options.scene = value;
    } else if (name == "--backend") {
      if (value != "cpu" && value != "host-loop" && value != "cuda") {
        throw std::invalid_argument("there is no backend '" + value +
                                    "'; use cpu, host-loop or cuda");
      }
      options.backends.push_back(value);
    } else if (name == "--count") {
      options.count = std::strtoull(value.c_str(), nullptr, 10);
      if (options.count < 100 || options.count > 50'000'000) {
        throw std::invalid_argument("--count must lie between 100 and 50000000");
      }
    } else if (name == "--size") {
      if (std::sscanf(value.c_str(), "%dx%d", &options.width, &options.height) != 2 ||
          options.width < 16 || options.height < 16 || options.width > 16384 ||
          options.height > 16384) {
        throw std::invalid_argument("--size is WxH, each between 16 and 16384");
      }
    } else {
      throw std::invalid_argument("there is no option '" + name + "'");
    }
  }
  return options;
}

std::uint64_t PixelsOff(const Frame& a, const Frame& b) {
  std::uint64_t off = 0;
  for (std::size_t i = 0; i < a.color.size(); ++i) {
    const Pixel &p = a.color[i], &q = b.color[i];
    const float worst = std::max(
        {std::abs(p.r - q.r), std::abs(p.g - q.g), std::abs(p.b - q.b), std::abs(p.a - q.a)});
    if (!(worst <= 8.0f / 255)) ++off;
  }
  return off;
}

// Photographs looked up on one backend, compared with the CPU.
struct PhotoResult {
  std::string backend;
  std::uint64_t pool_bytes = 0, lookups = 0;
  double largest_difference = 0;  // linear colour
  PhotoTileSampler::Use use;
  double seconds = 0;
  bool passed = false;
  std::string error;
};

double LargestDifference(const Vec3f& a, const Vec3f& b) {
  const Vec3f d = a - b;
  const float worst = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
  return worst >= 0 ? worst : INFINITY;  // NaN
}

PhotoResult RunPhotos(const std::string& backend, std::uint64_t pool_bytes) {
  constexpr int kWidth = 2000, kHeight = 1500, kPhotos = 3;
  constexpr std::size_t kLookups = 100'000;
  PhotoResult r;
  r.backend = backend;
  r.pool_bytes = pool_bytes;
  try {
    const auto cpu = MakeCpuPhotoSampler();
    const auto sampler = backend == "cuda" ? MakeCudaPhotoSampler(pool_bytes, FirstUsableGpu().idx)
                                           : MakeHostLoopPhotoSampler(pool_bytes);
    std::vector<PhotoColors> expected(kLookups), got(kLookups);
    for (int k = 0; k < kPhotos; ++k) {
      const auto id = static_cast<std::uint32_t>(k);
      const PhotoPyramid pixels = MakeNoisePhoto(kWidth, kHeight, 0, id);
      const std::vector<PhotoLookup> lookups = MakeLookups(id, kWidth, kHeight, kLookups);
      const PhotoExtent extent{id, kWidth, kHeight, 0};
      cpu->Sample(extent, &pixels, lookups, expected.data(), {});
      const Stopwatch watch;
      sampler->Sample(extent, &pixels, lookups, got.data(), {});
      r.seconds += watch.Seconds();
      r.lookups += kLookups;
      for (std::size_t i = 0; i < kLookups; ++i) {
        r.largest_difference = std::max(
            {r.largest_difference, LargestDifference(got[i].footprint, expected[i].footprint),
             LargestDifference(got[i].surroundings, expected[i].surroundings)});
      }
    }
    r.use = sampler->use();
  } catch (const std::exception& error) {
    r.error = error.what();
  }
  // The device fuses multiplications and additions; a pixel from the wrong place is off by far
  // more. Its logarithm may choose a level a rounding away.
  r.passed = r.error.empty() && r.largest_difference <= 2e-5;
  return r;
}

void WriteReport(const Options& options, const std::string& cuda, bool passed,
                 const std::vector<Result>& results, const std::vector<ThesisCheck>& thesis,
                 const std::vector<PhotoResult>& photos) {
  JsonWriter json;
  json.BeginObject()
      .Field("program", "sherd_cuda_check")
      .Field("cuda", cuda)
      .Field("metaballs_of_peer_scenes", options.count)
      .Field("width", options.width)
      .Field("height", options.height)
      .Field("passed", passed)
      .Key("results")
      .BeginArray();
  for (const Result& r : results) {
    json.BeginObject()
        .Field("scene", r.scene)
        .Field("backend", r.backend)
        .Field("device", r.device)
        .Field("passed", r.passed);
    if (!r.error.empty()) json.Field("error", r.error);
    json.Field("pixels_off_from_cpu_by_more_than_8_255", r.off_from_cpu);
    if (r.has_reference) {
      const FrameDifference& d = r.difference;
      json.Field("pixels", d.pixels)
          .Field("missed", d.missed)
          .Field("invented", d.invented)
          .Field("pixels_off_by_more_than_8_255", d.color_off)
          .Field("largest_colour_difference", d.color_max)
          .Field("largest_depth_difference_in_radii", d.depth_max)
          .Field("largest_normal_difference_deg", d.normal_max_deg)
          .Field("grazing_pixels_left_out", d.grazing);
    }
    const RenderStats& s = r.stats;
    json.Field("metaballs", s.metaballs)
        .Field("metaballs_in_view", s.metaballs_in_view)
        .Field("tile_entries", s.tile_entries)
        .Field("rays", s.rays)
        .Field("hits", s.hits)
        .Field("rays_started_inside", s.rays_started_inside)
        .Field("grazing", s.grazing)
        .Field("unresolved", s.unresolved)
        .Field("seconds_prepare", s.seconds_prepare)
        .Field("seconds_bin", s.seconds_bin)
        .Field("seconds_trace", s.seconds_trace)
        .Field("seconds_total", s.seconds_total)
        .Field("bytes", s.bytes)
        .EndObject();
  }
  json.EndArray().Key("thesis_method").BeginArray();
  for (const ThesisCheck& check : thesis) Write(check, &json);
  json.EndArray().Key("photographs").BeginArray();
  for (const PhotoResult& r : photos) {
    json.BeginObject()
        .Field("backend", r.backend)
        .Field("passed", r.passed)
        .Field("pool_bytes", r.pool_bytes);
    if (r.error.empty()) {
      json.Field("lookups", r.lookups)
          .Field("largest_difference_from_cpu", r.largest_difference)
          .Field("tiles_loaded", r.use.tiles_loaded)
          .Field("rounds", r.use.rounds)
          .Field("seconds", r.seconds);
    } else {
      json.Field("error", r.error);
    }
    json.EndObject();
  }
  json.EndArray().EndObject();
  const std::string text = json.text();
  AtomicFile file(options.json);
  file.Write(text.data(), text.size());
  file.Commit();
}

Result RunScene(const CheckScene& scene, Renderer* renderer, const ReferenceFrame* reference,
                const Frame& cpu) {
  Result r;
  r.scene = scene.name;
  r.backend = renderer->backend();
  r.device = renderer->device();
  r.has_reference = reference != nullptr;
  RenderSettings settings;
  settings.planes = {true, true, true};
  settings.supersample = scene.supersample;
  try {
    const Frame frame = renderer->Render(scene.scene, scene.camera, settings);
    r.stats = frame.stats;
    r.off_from_cpu = PixelsOff(frame, cpu);
    if (reference) {
      r.difference = CompareToReference(frame, *reference, scene.scene.cloud->frame.unit);
      r.error = WhyOff(scene, frame, r.difference);
    } else if (r.off_from_cpu > r.stats.rays / 100000) {
      r.error = "pixels differ from the CPU's";
    }
  } catch (const std::exception& error) {
    r.error = error.what();
  }
  r.passed = r.error.empty();
  return r;
}

void Print(const Result& r) {
  std::printf("%-4s %-38s %-9s ", r.passed ? "ok" : "FAIL", r.scene.c_str(), r.backend.c_str());
  if (!r.error.empty()) std::printf("%s: ", r.error.c_str());
  if (r.has_reference) {
    std::printf("missed %llu invented %llu off %llu depth %.1e r",
                static_cast<unsigned long long>(r.difference.missed),
                static_cast<unsigned long long>(r.difference.invented),
                static_cast<unsigned long long>(r.difference.color_off), r.difference.depth_max);
  } else {
    std::printf("off from the CPU's %llu", static_cast<unsigned long long>(r.off_from_cpu));
  }
  std::printf(", %.1f ms\n", r.stats.seconds_total * 1e3);
  std::fflush(stdout);
}

void Print(const PhotoResult& r) {
  std::printf("%-4s photographs in %-21s %-9s ", r.passed ? "ok" : "FAIL",
              (std::to_string(r.pool_bytes >> 10) + " KiB").c_str(), r.backend.c_str());
  if (!r.error.empty()) {
    std::printf("%s\n", r.error.c_str());
    return;
  }
  std::printf("off from the CPU's by %.1e, %llu rounds, %.1f ms\n", r.largest_difference,
              static_cast<unsigned long long>(r.use.rounds), r.seconds * 1e3);
  std::fflush(stdout);
}

int Run(const Options& options) {
  const CudaStatus status = QueryCuda();
  const std::string cuda = status.available ? status.device : "not used: " + status.reason;
  std::printf("CUDA: %s\n", cuda.c_str());
  std::vector<std::string> names = options.backends;
  if (names.empty()) {
    names = {"cpu", "host-loop"};
    if (status.available) names.push_back("cuda");
  }
  const auto cpu = MakeCpuRenderer();
  std::vector<std::unique_ptr<Renderer>> renderers;
  for (const std::string& name : names) {
    if (name == "cpu") {
      renderers.push_back(MakeCpuRenderer());
    } else if (name == "host-loop") {
      renderers.push_back(MakeHostLoopRenderer());
    } else {
      renderers.push_back(MakeCudaRenderer(FirstUsableGpu()));  // throws where there is no GPU
    }
  }

  std::vector<Result> results;
  bool passed = true;
  for (const CheckScene& scene : MakeCheckScenes(options.count, options.width, options.height)) {
    if (scene.name.find(options.scene) == std::string::npos) continue;
    RenderSettings settings;
    settings.supersample = scene.supersample;
    const Frame cpu_frame = cpu->Render(scene.scene, scene.camera, settings);
    ReferenceFrame reference;
    const bool compare = scene.supersample == 1;
    if (compare) reference = ReferenceRender(scene.scene, scene.camera);
    for (const auto& renderer : renderers) {
      results.push_back(RunScene(scene, renderer.get(), compare ? &reference : nullptr, cpu_frame));
      Print(results.back());
      passed = passed && results.back().passed;
    }
  }
  std::vector<ThesisCheck> thesis;
  for (const CheckScene& scene : MakeCheckScenes(options.count, options.width, options.height)) {
    if (scene.name.find(options.scene) == std::string::npos) continue;
    for (const std::string& name : names) {
      if (name == "cpu") continue;
      for (const ThesisCheck& check : CheckThesis(scene, name)) {
        thesis.push_back(check);
        Print(check);
        passed = passed && check.passed;
      }
    }
  }
  std::vector<PhotoResult> photos;
  if (std::string("photographs").find(options.scene) != std::string::npos) {
    for (const std::string& name : names) {
      if (name == "cpu") continue;
      for (const std::uint64_t pool_bytes : {std::uint64_t{1} << 20, std::uint64_t{64} << 20}) {
        photos.push_back(RunPhotos(name, pool_bytes));
        Print(photos.back());
        passed = passed && photos.back().passed;
      }
    }
  }
  if (results.empty() && photos.empty()) {
    throw std::invalid_argument("no scene's name holds '" + options.scene + "'");
  }
  if (!options.json.empty()) WriteReport(options, cuda, passed, results, thesis, photos);
  std::printf("%s\n", passed ? "passed" : "FAILED");
  return passed ? 0 : 1;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  try {
    return sherd::Run(sherd::ParseOptions(argc, argv));
  } catch (const std::invalid_argument& error) {
    std::cerr << "sherd_cuda_check: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "sherd_cuda_check: " << error.what() << "\n";
    return 1;
  }
}
