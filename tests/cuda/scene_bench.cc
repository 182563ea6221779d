#include "scene_bench.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "cuda/host_loop.h"
#include "frame_times.h"
#include "metaball/median.h"
#include "metaball/stopwatch.h"
#include "moved_camera.h"

namespace sherd {
namespace {

void PrintScene(const char* what, const std::string& name, const PeerScene& peer) {
  std::printf("%-12s %-13s %9zu metaballs %4dx%-4d  ", what, name.c_str(), peer.scene.cloud->size(),
              peer.camera.width, peer.camera.height);
}

JsonWriter& BeginScene(const std::string& name, const PeerScene& peer, JsonWriter* json) {
  return json->BeginObject()
      .Field("scene", name)
      .Field("metaballs", std::uint64_t{peer.scene.cloud->size()})
      .Field("width", peer.camera.width)
      .Field("height", peer.camera.height);
}

// As programs do that draw one frame after another, the frame is handed back for the next.
RenderStats DrawOne(Renderer* renderer, const Scene& scene, const Camera& camera) {
  Frame frame = renderer->Render(scene, camera, {});
  RenderStats stats = frame.stats;
  renderer->Recycle(std::move(frame));
  return stats;
}

}  // namespace

void MeasureFrames(const BenchBackend& backend, const std::string& name, const PeerScene& peer,
                   const BenchOptions& options, bool count_work, JsonWriter* json) {
  const auto renderer = backend.MakeRenderer();
  const FrameTimes times = TimeFrames(peer, {}, options, renderer.get(), renderer.get());
  FrameWork work;
  if (count_work) work = CountFrameWork(peer.scene, peer.camera, {});
  PrintScene("frames", name, peer);
  PrintTimes(times);
  const RenderStats& stats = times.stats;
  BeginScene(name, peer, json)
      .Field("frames", options.frames)
      .Field("tile_entries", stats.tile_entries)
      .Field("hits", stats.hits)
      .Field("unresolved", stats.unresolved)
      .Field("bytes_beside_the_cloud", stats.bytes);
  WriteTimes(times, json);
  if (count_work) {
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

void MeasureFirstFrame(const BenchBackend& backend, const std::string& name, const PeerScene& peer,
                       JsonWriter* json) {
  constexpr int kRepeats = 7;
  constexpr std::uint64_t kTiny = 100;
  // The context is there from here on. What else the first picture of this size alone has to wait
  // for, such as kernels that only large clouds need, shows in the slowest of the repeats.
  backend.MakeRenderer()->Render(MakeHeightField(kTiny).scene, peer.camera.Resized(64, 36), {});
  std::vector<double> whole, prepare;
  for (int i = 0; i < kRepeats; ++i) {
    const Stopwatch watch;
    const auto renderer = backend.MakeRenderer();
    const Frame frame = renderer->Render(peer.scene, peer.camera, {});
    whole.push_back(watch.Seconds() * 1e3);
    prepare.push_back(frame.stats.seconds_prepare * 1e3);
  }
  const auto [least, most] = std::minmax_element(whole.begin(), whole.end());
  PrintScene("first frame", name, peer);
  std::printf("%8.3f ms (%.3f to %.3f), the cloud brought over in %.3f ms\n", Median(whole), *least,
              *most, Median(prepare));
  std::fflush(stdout);
  BeginScene(name, peer, json)
      .Field("renderers", kRepeats)
      .Field("milliseconds", Median(whole))
      .Field("milliseconds_least", *least)
      .Field("milliseconds_most", *most)
      .Field("milliseconds_bringing_the_cloud_over", Median(prepare))
      .EndObject();
}

void MeasureAgainstTheCpu(const BenchBackend& backend, const std::string& name,
                          const PeerScene& peer, const SmallReference& reference,
                          JsonWriter* json) {
  constexpr int kFrames = 5;
  const auto own = backend.MakeRenderer();
  const auto cpu = MakeCpuRenderer();
  std::vector<double> own_times, cpu_times;
  std::string cpu_device;
  for (int i = 0; i <= kFrames; ++i) {  // the first does not count
    const Camera camera = MovedCamera(peer.camera, i);
    const RenderStats own_stats = DrawOne(own.get(), peer.scene, camera);
    const RenderStats cpu_stats = DrawOne(cpu.get(), peer.scene, camera);
    if (i == 0) continue;
    own_times.push_back(own_stats.seconds_total * 1e3);
    cpu_times.push_back(cpu_stats.seconds_total * 1e3);
    cpu_device = cpu_stats.device;
  }
  const FrameDifference own_error = ErrorOf(own.get(), peer.scene, reference);
  const FrameDifference cpu_error = ErrorOf(cpu.get(), peer.scene, reference);
  const double own_time = Median(own_times), cpu_time = Median(cpu_times);
  PrintScene("the CPU", name, peer);
  std::printf("%8.3f ms, CPU %8.3f ms (%.1f x), wrong %.5f, CPU %.5f\n", own_time, cpu_time,
              cpu_time / own_time, own_error.WrongShare(), cpu_error.WrongShare());
  std::fflush(stdout);
  BeginScene(name, peer, json)
      .Field("frames", kFrames)
      .Field("cpu_device", cpu_device)
      .Field("milliseconds", own_time)
      .Field("cpu_milliseconds", cpu_time)
      .Field("cpu_over_backend", cpu_time / own_time)
      .Key("error");
  WriteError(own_error, json);
  json->Key("cpu_error");
  WriteError(cpu_error, json);
  json->EndObject();
}

}  // namespace sherd
