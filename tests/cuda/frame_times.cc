#include "frame_times.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "metaball/median.h"
#include "moved_camera.h"

namespace sherd {
namespace {

struct KernelSamples {
  std::string name;
  std::vector<double> milliseconds;
};

// A kernel that some frames do without has fewer samples than frames.
void AddTo(std::vector<KernelSamples>* samples, const std::vector<KernelTime>& frame) {
  for (const KernelTime& kernel : frame) {
    auto at = std::find_if(samples->begin(), samples->end(),
                           [&](const KernelSamples& s) { return s.name == kernel.name; });
    if (at == samples->end()) at = samples->insert(at, {kernel.name, {}});
    at->milliseconds.push_back(kernel.milliseconds);
  }
}

}  // namespace

double FrameTimes::Kernels() const {
  double sum = kernels.empty() ? NAN : 0.0;
  for (const KernelTime& kernel : kernels) sum += kernel.milliseconds;
  return sum;
}

std::vector<KernelTime> KernelsByName(const ProfilingRenderer& renderer) {
  std::vector<KernelTime> kernels;
  for (const KernelTime& launch : renderer.LastKernels()) {
    const auto at = std::find_if(kernels.begin(), kernels.end(),
                                 [&](const KernelTime& k) { return k.name == launch.name; });
    if (at == kernels.end()) {
      kernels.push_back(launch);
    } else {
      at->milliseconds += launch.milliseconds;
    }
  }
  return kernels;
}

FrameTimes TimeFrames(const PeerScene& peer, const RenderSettings& settings,
                      const BenchOptions& options, Renderer* renderer, ProfilingRenderer* profile) {
  FrameTimes times;
  std::vector<double> frames;
  std::vector<KernelSamples> kernels;
  for (const bool with_profile : {false, true}) {
    profile->EnableProfile(with_profile);
    for (int i = 0; i < options.warm_up + options.frames; ++i) {
      Frame frame = renderer->Render(peer.scene, MovedCamera(peer.camera, i), settings);
      const RenderStats stats = frame.stats;
      renderer->Recycle(std::move(frame));
      if (i < options.warm_up) continue;
      if (with_profile) {
        AddTo(&kernels, KernelsByName(*profile));
      } else {
        frames.push_back(stats.seconds_total * 1e3);
        times.stats = stats;
      }
    }
  }
  profile->EnableProfile(false);
  times.frame = Median(frames);
  for (const KernelSamples& kernel : kernels) {
    times.kernels.push_back({kernel.name, Median(kernel.milliseconds)});
  }
  return times;
}

void WriteTimes(const FrameTimes& times, JsonWriter* json) {
  json->Field("frame_milliseconds_to_host_memory", times.frame)
      .Field("kernels_milliseconds", times.Kernels())
      .Key("kernels")
      .BeginArray();
  for (const KernelTime& kernel : times.kernels) {
    json->BeginObject()
        .Field("name", kernel.name)
        .Field("milliseconds", kernel.milliseconds)
        .EndObject();
  }
  json->EndArray();
}

void PrintTimes(const FrameTimes& times) {
  std::printf("frame %8.3f ms", times.frame);
  if (!times.kernels.empty()) std::printf(", kernels %8.3f ms:", times.Kernels());
  for (const KernelTime& kernel : times.kernels) {
    std::printf(" %s %.3f", kernel.name.c_str(), kernel.milliseconds);
  }
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace sherd
