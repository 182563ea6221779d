// Every backend of this machine against the double-precision reference, scene by scene.
//
//   sherd_cuda_check [--json FILE] [--count N] [--size WxH] [--backend NAME]... [--scene TEXT]
//
// Backends: cpu, host-loop (the CUDA kernels' bodies run on the CPU), cuda where a GPU can be used.
// What the reference does not draw is held against the CPU: appearances and planes
// (feature_check.h), what renderers do beyond a frame (renderer_check.h), the thesis's method
// (thesis_check.h), photographs (photo_check.h). --scene takes those whose name holds the text.
// Needs a compiler and the toolkit, nothing else. Exits with 1 when a backend breaks the contract,
// 2 when a command line cannot be used.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "backends.h"
#include "bench_options.h"
#include "cuda/renderers.h"
#include "exit_code.h"
#include "feature_check.h"
#include "json_writer.h"
#include "metaball/frame_difference.h"
#include "photo_check.h"
#include "renderer_check.h"
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

void WriteReport(const Options& options, const std::string& cuda, bool passed,
                 const std::vector<Result>& results, const std::vector<FeatureCheck>& features,
                 const std::vector<ThesisCheck>& thesis, const std::vector<PhotoCheck>& photos) {
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
  json.EndArray().Key("features").BeginArray();
  for (const FeatureCheck& check : features) Write(check, &json);
  json.EndArray().Key("thesis_method").BeginArray();
  for (const ThesisCheck& check : thesis) Write(check, &json);
  json.EndArray().Key("photographs").BeginArray();
  for (const PhotoCheck& check : photos) Write(check, &json);
  json.EndArray().EndObject();
  WriteText(options.json, json.text());
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

void CheckFeatures(const Options& options, const std::vector<std::string>& backends,
                   const std::function<void(const FeatureCheck&)>& record) {
  std::vector<FeatureScene> features = MakeAppearanceScenes(options.width, options.height);
  for (FeatureScene& feature : MakePlaneScenes(options.width, options.height)) {
    features.push_back(std::move(feature));
  }
  for (const FeatureScene& feature : features) {
    if (feature.name.find(options.scene) == std::string::npos) continue;
    for (const FeatureCheck& check : CheckFeature(feature, backends)) record(check);
  }
  for (const std::string& backend : backends) {
    for (const auto& checks :
         {CheckMovingClouds(backend, options.scene), CheckParts(features, backend, options.scene),
          CheckSharing(features, backend, options.scene),
          CheckLevelsOfDetail(backend, options.scene)}) {
      for (const FeatureCheck& check : checks) record(check);
    }
  }
}

int Run(const Options& options) {
  const CudaStatus status = QueryCuda();
  const std::string cuda = status.available ? status.device : "not used: " + status.reason;
  std::printf("CUDA: %s\n", cuda.c_str());
  std::vector<std::string> names = options.backends;
  if (names.empty()) {
    names = BackendsBesideTheCpu();
    names.insert(names.begin(), "cpu");
  }
  const auto cpu = MakeCpuRenderer();
  std::vector<std::unique_ptr<Renderer>> renderers;
  for (const std::string& name : names) renderers.push_back(MakeBackend(name));
  // The CPU is what the rest is held against.
  std::vector<std::string> others = names;
  std::erase(others, "cpu");

  std::vector<Result> results;
  bool passed = true;
  std::vector<CheckScene> scenes = MakeCheckScenes(options.count, options.width, options.height);
  std::erase_if(scenes, [&](const CheckScene& scene) {
    return scene.name.find(options.scene) == std::string::npos;
  });
  for (const CheckScene& scene : scenes) {
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
  const auto record = [&passed]<class Check>(const Check& check, std::vector<Check>* checks) {
    Print(check);
    passed = passed && check.passed;
    checks->push_back(check);
  };
  std::vector<FeatureCheck> features;
  CheckFeatures(options, others, [&](const FeatureCheck& check) { record(check, &features); });
  std::vector<ThesisCheck> thesis;
  for (const CheckScene& scene : scenes) {
    for (const std::string& name : others) {
      for (const ThesisCheck& check : CheckThesis(scene, name)) record(check, &thesis);
    }
  }
  std::vector<PhotoCheck> photos;
  if (std::string("photographs").find(options.scene) != std::string::npos) {
    for (const std::string& name : others) {
      for (const std::uint64_t pool_bytes : {std::uint64_t{1} << 20, std::uint64_t{64} << 20}) {
        for (const bool holes : {false, true}) {
          record(CheckPhotos(name, pool_bytes, holes), &photos);
        }
      }
    }
  }
  if (results.empty() && features.empty() && photos.empty()) {
    throw std::invalid_argument("no scene's name holds '" + options.scene + "'");
  }
  if (!options.json.empty()) WriteReport(options, cuda, passed, results, features, thesis, photos);
  std::printf("%s\n", passed ? "passed" : "FAILED");
  return passed ? 0 : 1;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  return sherd::ExitCodeOf("sherd_cuda_check",
                           [&] { return sherd::Run(sherd::ParseOptions(argc, argv)); });
}
