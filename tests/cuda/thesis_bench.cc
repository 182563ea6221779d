#include "thesis_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "metaball/median.h"
#include "moved_camera.h"

namespace sherd {
namespace {

struct Rival {
  std::string name;
  std::unique_ptr<ProfilingRenderer> renderer;
  std::vector<double> frames, kernels;  // milliseconds
  double prepare = 0;                   // seconds, of the first frame
  RenderStats stats;
  FrameDifference error;
};

double KernelMilliseconds(const ProfilingRenderer& renderer) {
  const std::vector<KernelTime> kernels = renderer.LastKernels();
  double sum = kernels.empty() ? NAN : 0.0;
  for (const KernelTime& kernel : kernels) sum += kernel.milliseconds;
  return sum;
}

// NaN where nothing was timed.
double MedianOf(const std::vector<double>& milliseconds) {
  const bool timed = !std::isnan(milliseconds.front());
  return timed ? Median(milliseconds) : NAN;
}

}  // namespace

void MeasureThesis(const BenchBackend& backend, const std::string& name, const PeerScene& peer,
                   const SmallReference& reference, const BenchOptions& options, JsonWriter* json) {
  std::vector<Rival> rivals;
  const auto add = [&](const char* rival, std::unique_ptr<ProfilingRenderer> renderer) {
    rivals.emplace_back();
    rivals.back().name = rival;
    rivals.back().renderer = std::move(renderer);
  };
  add("ours", backend.MakeRenderer());
  add("thesis, gated", backend.MakeThesisRenderer({.gated = true}));
  add("thesis, not gated", backend.MakeThesisRenderer({.gated = false}));
  // Whole frames without the profile's events, then kernels with them; one after another, so that
  // what slows the machine slows all.
  const int warm_up = std::max(1, options.warm_up);
  for (const bool profile : {false, true}) {
    for (Rival& rival : rivals) rival.renderer->EnableProfile(profile);
    for (int i = 0; i < warm_up + options.frames; ++i) {
      const Camera camera = MovedCamera(peer.camera, i);
      for (Rival& rival : rivals) {
        Frame frame = rival.renderer->Render(peer.scene, camera, {});
        const RenderStats stats = frame.stats;
        rival.renderer->Recycle(std::move(frame));
        if (!profile && i == 0) rival.prepare = stats.seconds_prepare;
        if (i < warm_up) continue;
        if (profile) {
          rival.kernels.push_back(KernelMilliseconds(*rival.renderer));
        } else {
          rival.frames.push_back(stats.seconds_total * 1e3);
          rival.stats = stats;
        }
      }
    }
  }
  for (Rival& rival : rivals) {
    rival.error = ErrorOf(rival.renderer.get(), peer.scene, reference);
  }

  const double ours = Median(rivals[0].frames), our_kernels = MedianOf(rivals[0].kernels);
  json->BeginObject()
      .Field("scene", name)
      .Field("metaballs", rivals[0].stats.metaballs)
      .Field("width", peer.camera.width)
      .Field("height", peer.camera.height)
      .Field("frames", options.frames)
      .Key("renderers")
      .BeginArray();
  for (const Rival& rival : rivals) {
    const double frame = Median(rival.frames), kernels = MedianOf(rival.kernels);
    std::printf(
        "thesis       %-13s %9llu metaballs %4dx%-4d  %-17s frame %8.3f ms (%6.1f x ours), ",
        name.c_str(), static_cast<unsigned long long>(rival.stats.metaballs), peer.camera.width,
        peer.camera.height, rival.name.c_str(), frame, frame / ours);
    if (!std::isnan(kernels)) std::printf("kernels %8.3f ms, ", kernels);
    std::printf("wrong %.4f\n", rival.error.WrongShare());
    std::fflush(stdout);
    json->BeginObject()
        .Field("renderer", rival.name)
        .Field("frame_milliseconds_to_host_memory", frame)
        .Field("frame_over_ours", frame / ours)
        .Field("kernels_milliseconds", kernels)
        .Field("kernels_over_ours", kernels / our_kernels)
        .Field("seconds_prepare_once", rival.prepare)
        .Field("hits", rival.stats.hits)
        .Field("unresolved", rival.stats.unresolved)
        .Field("bytes_beside_the_cloud", rival.stats.bytes)
        .Key("error");
    WriteError(rival.error, json);
    json->EndObject();
  }
  json->EndArray().EndObject();
}

}  // namespace sherd
