#include "metaball/cpu_renderer.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "metaball/error.h"
#include "metaball/local_view.h"
#include "metaball/parallel.h"
#include "metaball/supersample.h"
#include "metaball/trace_job.h"

namespace sherd {
namespace {

class Stopwatch {
 public:
  double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

class CpuRenderer final : public Renderer {
 public:
  explicit CpuRenderer(CpuPath path) : path_(path) {}

  std::string backend() const override { return "cpu"; }
  std::string device() const override { return DeviceFor(0); }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    CheckRenderInput(scene, camera, settings);
    if (settings.supersample > 1) {
      return RenderSupersampled(this, scene, camera, settings, control);
    }
    const Stopwatch total;
    Frame frame = MakeFrame(camera, settings.planes);
    frame.stats.backend = backend();
    frame.stats.device = DeviceFor(settings.threads);
    const Cloud& cloud = *scene.cloud;
    frame.stats.metaballs = cloud.size();
    frame.stats.rays = frame.color.size();
    if (cloud.empty()) {
      frame.stats.seconds_total = total.Seconds();
      return frame;
    }

    TraceJob job;
    job.cloud = &cloud;
    job.camera = LocalCamera(camera, cloud.frame);
    job.bins = &bins_;
    job.light = PrepareLight(scene.lighting);
    job.threshold = static_cast<float>(scene.surface.threshold);
    job.radius_scale = static_cast<float>(scene.surface.radius_scale);
    job.frame = &frame;

    const Stopwatch bin;
    bins_.Build(cloud, job.radius_scale, ViewOf(job.camera), settings.threads, control);
    frame.stats.seconds_bin = bin.Seconds();
    frame.stats.metaballs_in_view = bins_.metaballs_in_view();
    frame.stats.tile_entries = bins_.entries();

    const Stopwatch trace;
    Trace(job, settings.threads, control, &frame.stats);
    frame.stats.seconds_trace = trace.Seconds();
    frame.stats.bytes = bins_.MemoryBytes();
    frame.stats.seconds_total = total.Seconds();
    return frame;
  }

 private:
  std::string DeviceFor(int threads) const {
    const int count = ThreadCount(threads);
    std::string name = std::to_string(count) + (count == 1 ? " thread, " : " threads, ");
#ifdef SHERD_HAVE_HIGHWAY
    if (path_ == CpuPath::kBest) return name + PacketTargetName();
#endif
    return name + "scalar";
  }

  void Trace(const TraceJob& job, int threads, const Control& control, RenderStats* stats) const {
    auto* trace_tile = &TraceTileScalar;
#ifdef SHERD_HAVE_HIGHWAY
    if (path_ == CpuPath::kBest) trace_tile = &TraceTilePackets;
#endif
    // A cache line of its own for each worker's counts.
    struct alignas(64) WorkerCounts : TraceCounts {};
    std::vector<WorkerCounts> counts(ThreadCount(threads));
    const int tiles = job.bins->tiles_x() * job.bins->tiles_y();
    std::atomic<int> done{0};
    ParallelFor(tiles, threads, [&](std::int64_t tile, int worker) {
      control.ThrowIfStopped();
      if (job.bins->count(static_cast<int>(tile)) > 0) {
        trace_tile(job, static_cast<int>(tile), &counts[worker]);
      }
      const int finished = ++done;
      if (control.progress && worker == 0 && finished % 64 == 0) {
        control.Report("tracing", static_cast<double>(finished) / tiles);
      }
    });
    for (const WorkerCounts& c : counts) {
      stats->hits += c.hits;
      stats->rays_started_inside += c.rays.started_inside;
      stats->grazing += c.rays.grazing;
      stats->unresolved += c.rays.unresolved;
    }
  }

  CpuPath path_;
  TileBins bins_;
};

}  // namespace

std::unique_ptr<Renderer> MakeCpuRenderer(CpuPath path) {
  return std::make_unique<CpuRenderer>(path);
}
std::unique_ptr<Renderer> MakeCpuRenderer() { return MakeCpuRenderer(CpuPath::kBest); }

}  // namespace sherd
