// Milliseconds for every kernel of a frame, on the two scenes of docs/performance.md.
//
//   sherd_cuda_bench [--json FILE] [--counts N,N,...] [--sizes WxH,WxH,...] [--frames N]
//                    [--count-work]
//
// Each frame has a camera of its own; the medians over the frames after a warm-up are reported, by
// CUDA events for the kernels and by the host's clock for whole frames. Without a GPU it says so
// and ends. --count-work adds the operations a frame consists of (counted by the host loop, which
// takes its time), with which a measured time can be held against the device's limits.
// Photographs are looked up too: a million lookups in eight pictures of 11 megapixels, on the CPU,
// on the GPU with an empty store and with one that holds what they read. And the thesis's method is
// drawn beside ours on the same GPU, at the first of the sizes (thesis_bench.h).
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "cuda/cuda_renderer.h"
#include "cuda/host_loop.h"
#include "cuda/photo_sampler.h"
#include "cuda/renderers.h"
#include "datasets_synthetic/peer_scenes.h"
#include "json_writer.h"
#include "metaball/atomic_file.h"
#include "metaball/median.h"
#include "metaball/photo/sampler.h"
#include "metaball/stopwatch.h"
#include "moved_camera.h"
#include "photo_scenes.h"
#include "thesis_bench.h"

namespace sherd {
namespace {

struct Size {
  int width, height;
};

struct Options {
  std::string json;
  std::vector<std::uint64_t> counts{10000, 63000, 250000, 500000, 1000000, 5000000};
  std::vector<Size> sizes{{1280, 720}, {1920, 1080}, {3840, 2160}};
  int frames = 50;
  bool count_work = false;
};

std::vector<std::string> Split(const std::string& list) {
  std::vector<std::string> parts;
  std::istringstream stream(list);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

Options ParseOptions(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--count-work") {
      options.count_work = true;
      continue;
    }
    if (i + 1 == argc) throw std::invalid_argument(name + " needs a value");
    const std::string value = argv[++i];
    if (name == "--json") {
      options.json = value;
    } else if (name == "--frames") {
      options.frames = std::atoi(value.c_str());
      if (options.frames < 1) throw std::invalid_argument("--frames must be at least 1");
    } else if (name == "--counts") {
      options.counts.clear();
      for (const std::string& part : Split(value)) {
        options.counts.push_back(std::strtoull(part.c_str(), nullptr, 10));
        if (options.counts.back() < 1) throw std::invalid_argument("--counts: '" + part + "'");
      }
    } else if (name == "--sizes") {
      options.sizes.clear();
      for (const std::string& part : Split(value)) {
        Size size{};
        if (std::sscanf(part.c_str(), "%dx%d", &size.width, &size.height) != 2 || size.width < 1 ||
            size.height < 1) {
          throw std::invalid_argument("--sizes: '" + part + "' is not WxH");
        }
        options.sizes.push_back(size);
      }
    } else {
      throw std::invalid_argument("there is no option '" + name + "'");
    }
  }
  return options;
}

void Measure(const std::string& name, const PeerScene& peer, const Options& options,
             ProfilingRenderer* renderer, JsonWriter* json) {
  constexpr int kWarmUp = 5;
  std::vector<std::string> order;
  std::map<std::string, std::vector<double>> kernels;
  std::vector<double> frames;
  RenderStats stats;
  // Whole frames without the profile's events, then kernels with them.
  for (const bool profile : {false, true}) {
    renderer->EnableProfile(profile);
    for (int i = 0; i < kWarmUp + options.frames; ++i) {
      const Frame frame = renderer->Render(peer.scene, MovedCamera(peer.camera, i), {});
      if (i < kWarmUp) continue;
      if (!profile) {
        frames.push_back(frame.stats.seconds_total * 1e3);
        stats = frame.stats;
        continue;
      }
      for (const KernelTime& kernel : renderer->LastKernels()) {
        if (!kernels.contains(kernel.name)) order.push_back(kernel.name);
        kernels[kernel.name].push_back(kernel.milliseconds);
      }
    }
  }
  const double total = Median(frames);
  double on_device = 0;
  for (const auto& [kernel, times] : kernels) on_device += Median(times);
  std::printf("%-13s %9llu metaballs %4dx%-4d  frame %8.3f ms, kernels %8.3f ms:", name.c_str(),
              static_cast<unsigned long long>(stats.metaballs), peer.camera.width,
              peer.camera.height, total, on_device);
  json->BeginObject()
      .Field("scene", name)
      .Field("metaballs", stats.metaballs)
      .Field("width", peer.camera.width)
      .Field("height", peer.camera.height)
      .Field("frames", options.frames)
      .Field("frame_milliseconds_to_host_memory", total)
      .Field("kernels_milliseconds", on_device)
      .Field("tile_entries", stats.tile_entries)
      .Field("hits", stats.hits)
      .Field("unresolved", stats.unresolved)
      .Field("bytes_beside_the_cloud", stats.bytes)
      .Key("kernels")
      .BeginArray();
  for (const std::string& kernel : order) {
    std::printf(" %s %.3f", kernel.c_str(), Median(kernels[kernel]));
    json->BeginObject()
        .Field("name", kernel)
        .Field("milliseconds", Median(kernels[kernel]))
        .EndObject();
  }
  std::printf("\n");
  std::fflush(stdout);
  json->EndArray();
  if (options.count_work) {
    const FrameWork work = CountFrameWork(peer.scene, peer.camera, {});
    json->Key("work")
        .BeginObject()
        .Field("metaballs_tried_against_rays", work.tests)
        .Field("metaballs_added_to_bounds", work.adds)
        .Field("march_steps", work.steps)
        .Field("metaballs_tried_at_hits", work.shade_adds)
        .Field("rays_beyond_their_column", work.wide_rays)
        .EndObject();
  }
  json->EndObject();
}

void MeasurePhotographs(JsonWriter* json) {
  constexpr int kWidth = 4096, kHeight = 2732, kPhotos = 8, kRepeats = 5;
  constexpr std::size_t kLookups = 131'072;
  std::vector<PhotoPyramid> pixels;
  std::vector<std::vector<PhotoLookup>> lookups;
  for (int k = 0; k < kPhotos; ++k) {
    const auto id = static_cast<std::uint32_t>(k);
    pixels.push_back(MakeNoisePhoto(kWidth, kHeight, 0, id));
    lookups.push_back(MakeLookups(id, kWidth, kHeight, kLookups));
  }
  std::vector<PhotoColors> colors(kLookups);
  const auto seconds = [&](PhotoSampler* sampler) {
    const Stopwatch watch;
    for (int k = 0; k < kPhotos; ++k) {
      const PhotoExtent extent{static_cast<std::uint32_t>(k), kWidth, kHeight, 0};
      sampler->Sample(extent, &pixels[k], lookups[k], colors.data(), {});
    }
    return watch.Seconds();
  };
  std::vector<double> cpu, cold, warm;
  PhotoTileSampler::Use use;
  const auto on_cpu = MakeCpuPhotoSampler();
  for (int i = 0; i < kRepeats; ++i) {
    cpu.push_back(seconds(on_cpu.get()));
    const auto sampler = MakeCudaPhotoSampler(0, FirstUsableGpu().idx);
    cold.push_back(seconds(sampler.get()));
    warm.push_back(seconds(sampler.get()));
    use = sampler->use();
  }
  std::printf("photographs: %d lookups, CPU %.3f s, GPU %.3f s empty, %.3f s filled\n",
              kPhotos * static_cast<int>(kLookups), Median(cpu), Median(cold), Median(warm));
  json->Key("photographs")
      .BeginObject()
      .Field("lookups", std::uint64_t{kPhotos} * kLookups)
      .Field("tiles", use.tiles_loaded)
      .Field("pool_bytes", use.pool_bytes)
      .Field("cpu_seconds", Median(cpu))
      .Field("cuda_seconds_empty_store", Median(cold))
      .Field("cuda_seconds_filled_store", Median(warm))
      .EndObject();
}

std::string NameOfPeer(bool shell) { return shell ? "shell" : "height_field"; }

// The same horizontal angle on square pixels.
PeerScene Sized(const PeerScene& peer, const Size& size) {
  const double scale = static_cast<double>(size.width) / peer.camera.width;
  PeerScene sized = peer;
  sized.camera.width = size.width;
  sized.camera.height = size.height;
  sized.camera.fx *= scale;
  sized.camera.fy *= scale;
  sized.camera.cx = 0.5 * size.width;
  sized.camera.cy = 0.5 * size.height;
  return sized;
}

int Run(const Options& options) {
  const CudaStatus status = QueryCuda();
  if (!status.available) {
    std::printf("no GPU to measure: %s\n", status.reason.c_str());
    return 0;
  }
  const auto renderer = MakeCudaRenderer(FirstUsableGpu());
  std::printf("%s\n", renderer->device().c_str());
  JsonWriter json;
  json.BeginObject()
      .Field("program", "sherd_cuda_bench")
      .Field("device", renderer->device())
      .Key("measurements")
      .BeginArray();
  for (const std::uint64_t count : options.counts) {
    for (const bool shell : {false, true}) {
      const PeerScene peer = shell ? MakeShell(count) : MakeHeightField(count);
      for (const Size& size : options.sizes) {
        Measure(NameOfPeer(shell), Sized(peer, size), options, renderer.get(), &json);
      }
    }
  }
  json.EndArray().Key("thesis_method").BeginArray();
  for (const std::uint64_t count : options.counts) {
    for (const bool shell : {false, true}) {
      const PeerScene peer = shell ? MakeShell(count) : MakeHeightField(count);
      MeasureThesis(NameOfPeer(shell), Sized(peer, options.sizes.front()), options.frames, &json);
    }
  }
  json.EndArray();
  MeasurePhotographs(&json);
  json.EndObject();
  if (!options.json.empty()) {
    const std::string text = json.text();
    AtomicFile file(options.json);
    file.Write(text.data(), text.size());
    file.Commit();
  }
  return 0;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  try {
    return sherd::Run(sherd::ParseOptions(argc, argv));
  } catch (const std::invalid_argument& error) {
    std::cerr << "sherd_cuda_bench: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "sherd_cuda_bench: " << error.what() << "\n";
    return 1;
  }
}
