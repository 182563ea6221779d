#include "thesis_bench.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "cuda/cuda_renderer.h"
#include "cuda/cuda_thesis_renderer.h"
#include "cuda/renderers.h"
#include "metaball/frame_difference.h"
#include "metaball/median.h"
#include "metaball/reference/reference.h"
#include "moved_camera.h"

namespace sherd {
namespace {

constexpr int kErrorWidth = 160;  // of the picture that is held against the reference
constexpr int kWarmUp = 3;

struct Rival {
  std::string name;
  std::unique_ptr<ProfilingRenderer> renderer;
  std::vector<double> frames, kernels;  // milliseconds
  double prepare = 0;                   // seconds, of the first frame
  RenderStats stats;
};

double KernelMilliseconds(const ProfilingRenderer& renderer) {
  double sum = 0;
  for (const KernelTime& kernel : renderer.LastKernels()) sum += kernel.milliseconds;
  return sum;
}

void WriteError(const FrameDifference& d, JsonWriter* json) {
  json->Key("error")
      .BeginObject()
      .Field("pixels", d.pixels)
      .Field("missed", d.missed)
      .Field("invented", d.invented)
      .Field("pixels_off_by_more_than_8_255", d.color_off)
      .Field("wrong_share", d.WrongShare())
      .Field("median_depth_difference_in_radii", d.depth_median)
      .Field("p99_depth_difference_in_radii", d.depth_p99)
      .Field("largest_depth_difference_in_radii", d.depth_max)
      .Field("p99_colour_difference_delta_e", d.delta_e_p99)
      .EndObject();
}

}  // namespace

void MeasureThesis(const std::string& name, const PeerScene& peer, int frames, JsonWriter* json) {
  std::vector<Rival> rivals;
  rivals.push_back({"ours", MakeCudaRenderer(FirstUsableGpu()), {}, {}, 0, {}});
  for (const bool gated : {true, false}) {
    rivals.push_back({gated ? "thesis, gated" : "thesis, not gated",
                      MakeCudaThesisRenderer(FirstUsableGpu(), {.gated = gated}),
                      {},
                      {},
                      0,
                      {}});
  }
  // Whole frames without the profile's events, then kernels with them; one after another, so that
  // what slows the machine slows all.
  for (const bool profile : {false, true}) {
    for (Rival& rival : rivals) rival.renderer->EnableProfile(profile);
    for (int i = 0; i < kWarmUp + frames; ++i) {
      const Camera camera = MovedCamera(peer.camera, i);
      for (Rival& rival : rivals) {
        const RenderStats stats = rival.renderer->Render(peer.scene, camera, {}).stats;
        if (!profile && i == 0) rival.prepare = stats.seconds_prepare;
        if (i < kWarmUp) continue;
        if (profile) {
          rival.kernels.push_back(KernelMilliseconds(*rival.renderer));
        } else {
          rival.frames.push_back(stats.seconds_total * 1e3);
          rival.stats = stats;
        }
      }
    }
  }

  const Camera small = peer.camera.Resized(
      kErrorWidth, std::max(1, kErrorWidth * peer.camera.height / peer.camera.width));
  const ReferenceFrame reference = ReferenceRender(peer.scene, small);
  RenderSettings planes;
  planes.planes.depth = planes.planes.normal = true;
  const double ours = Median(rivals[0].frames), our_kernels = Median(rivals[0].kernels);
  json->BeginObject()
      .Field("scene", name)
      .Field("metaballs", rivals[0].stats.metaballs)
      .Field("width", peer.camera.width)
      .Field("height", peer.camera.height)
      .Field("frames", frames)
      .Key("renderers")
      .BeginArray();
  for (Rival& rival : rivals) {
    const FrameDifference d = CompareToReference(rival.renderer->Render(peer.scene, small, planes),
                                                 reference, peer.scene.cloud->frame.unit);
    const double frame = Median(rival.frames), kernels = Median(rival.kernels);
    std::printf(
        "%-13s %9llu metaballs %4dx%-4d  %-17s frame %8.3f ms (%6.1f x ours), kernels "
        "%8.3f ms, wrong %.4f\n",
        name.c_str(), static_cast<unsigned long long>(rival.stats.metaballs), peer.camera.width,
        peer.camera.height, rival.name.c_str(), frame, frame / ours, kernels, d.WrongShare());
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
        .Field("bytes_beside_the_cloud", rival.stats.bytes);
    WriteError(d, json);
    json->EndObject();
  }
  json->EndArray().EndObject();
}

}  // namespace sherd
