#include "metaball/cpu_renderer.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "metaball/appearance/deferred.h"
#include "metaball/error.h"
#include "metaball/local_view.h"
#include "metaball/parallel.h"
#include "metaball/precision.h"
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
    if (NeedsDeferredPasses(scene)) {
      return RenderDeferred(this, scene, camera, settings, control);
    }
    CheckRenderInput(scene, camera, settings);
    if (settings.supersample > 1) {
      return RenderSupersampled(this, scene, camera, settings, control);
    }
    const Stopwatch total;
    Frame frame = MakeFrame(camera, settings.planes);
    frame.stats.backend = backend();
    frame.stats.device = DeviceFor(settings.threads);
    const Cloud& cloud = *scene.cloud;
    std::optional<SurfaceGather> gather;
    if (settings.planes.NeedGather()) gather.emplace(cloud, scene.surface, settings.planes, &frame);
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
    const ResolvedDensity density = ResolveDensity(scene.surface.density);
    job.shape = density.shape;
    job.mode = scene.surface.mode;
    job.threshold = scene.surface.threshold;
    job.threshold_scale = 1.0 / density.amplitude;
    job.radius_scale = scene.surface.radius_scale * density.support;
    job.double_precision = HasWideRadii(cloud) || HasStiffThreshold(scene.surface);
    job.frame = &frame;
    job.gather = gather ? &*gather : nullptr;

    const Stopwatch bin;
    bins_.Build(cloud, static_cast<float>(job.radius_scale), ViewOf(job.camera), settings.threads,
                control);
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

  TileTracer TracerFor(const TraceJob& job) const {
#ifdef SHERD_HAVE_HIGHWAY
    if (path_ == CpuPath::kBest) {
      if (const TileTracer packets = PacketTracerFor(job)) return packets;
    }
#endif
    return ScalarTracerFor(job);
  }

  void Trace(const TraceJob& job, int threads, const Control& control, RenderStats* stats) const {
    TraceJob in_doubles = job;
    in_doubles.double_precision = true;
    const TileTracer trace_tile = TracerFor(job), trace_in_doubles = TracerFor(in_doubles);
    // A cache line of its own for each worker's counts.
    struct alignas(64) WorkerCounts : TraceCounts {};
    std::vector<WorkerCounts> counts(ThreadCount(threads));
    const int tiles = job.bins->tiles_x() * job.bins->tiles_y();
    std::atomic<int> done{0};
    ParallelFor(tiles, threads, [&](std::int64_t tile, int worker) {
      control.ThrowIfStopped();
      if (job.bins->count(static_cast<int>(tile)) > 0) {
        const TraceCounts before = counts[worker];
        trace_tile(job, static_cast<int>(tile), &counts[worker]);
        if (counts[worker].rays.crowded > 0) {
          static_cast<TraceCounts&>(counts[worker]) = before;
          const int x0 = static_cast<int>(tile) % job.bins->tiles_x() * kTileSize;
          const int y0 = static_cast<int>(tile) / job.bins->tiles_x() * kTileSize;
          job.frame->Clear(x0, y0, x0 + kTileSize, y0 + kTileSize);
          trace_in_doubles(in_doubles, static_cast<int>(tile), &counts[worker]);
        }
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
