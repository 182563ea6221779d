#include "metaball/cpu_renderer.h"

#include <atomic>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "metaball/appearance/deferred.h"
#include "metaball/error.h"
#include "metaball/frame_work.h"
#include "metaball/parallel.h"
#include "metaball/precision.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"
#include "metaball/trace_job.h"

namespace sherd {
namespace {

class CpuRenderer final : public Renderer {
 public:
  explicit CpuRenderer(CpuPath path) : path_(path) {}

  std::string backend() const override { return "cpu"; }
  std::string device() const override { return DeviceFor(0); }
  void Recycle(Frame frame) override { spare_ = std::move(frame); }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    if (NeedsDeferredPasses(scene, settings.planes)) {
      return RenderDeferred(this, scene, camera, settings, control);
    }
    CheckRenderInput(scene, camera, settings);
    if (settings.supersample > 1) {
      return RenderSupersampled(this, scene, camera, settings, control);
    }
    const Stopwatch total;
    Frame frame = BeginFrame(*this, DeviceFor(settings.threads), scene, camera, settings.planes,
                             std::exchange(spare_, {}));
    const Cloud& cloud = *scene.cloud;
    std::optional<SurfaceGather> gather;
    if (settings.planes.NeedGather()) gather.emplace(cloud, scene.surface, settings.planes, &frame);
    if (cloud.empty()) {
      frame.stats.seconds_total = total.Seconds();
      return frame;
    }

    TraceJob job = JobOf(scene, camera, &bins_, &frame);
    job.double_precision = HasWideRadii(cloud) || HasStiffThreshold(scene.surface);
    job.gather = gather ? &*gather : nullptr;
    BinMetaballs(job, settings.threads, control, &bins_, &frame.stats);
    const Stopwatch trace;
    Trace(job, settings.threads, control, &frame.stats);
    frame.stats.seconds_trace = trace.Seconds();
    frame.stats.seconds_total = total.Seconds();
    return frame;
  }

 private:
  std::string DeviceFor(int threads) const {
#ifdef SHERD_HAVE_HIGHWAY
    if (path_ == CpuPath::kBest) return ThreadsAnd(threads, PacketTargetName());
#endif
    return ThreadsAnd(threads, "scalar");
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
          const PixelBox pixels = job.bins->PixelsOf(static_cast<int>(tile));
          job.frame->Clear(pixels.x0, pixels.y0, pixels.x1, pixels.y1);
          trace_in_doubles(in_doubles, static_cast<int>(tile), &counts[worker]);
        }
      }
      const int finished = ++done;
      if (control.progress && worker == 0 && finished % 64 == 0) {
        control.Report("tracing", static_cast<double>(finished) / tiles);
      }
    });
    for (const WorkerCounts& c : counts) AddCounts(c, stats);
  }

  CpuPath path_;
  TileBins bins_;
  Frame spare_;
};

}  // namespace

std::unique_ptr<Renderer> MakeCpuRenderer(CpuPath path) {
  return std::make_unique<CpuRenderer>(path);
}
std::unique_ptr<Renderer> MakeCpuRenderer() { return MakeCpuRenderer(CpuPath::kBest); }

}  // namespace sherd
