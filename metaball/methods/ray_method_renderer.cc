#include <atomic>
#include <cmath>
#include <utility>
#include <vector>

#include "metaball/appearance/deferred.h"
#include "metaball/error.h"
#include "metaball/frame_work.h"
#include "metaball/methods/hit_pixel.h"
#include "metaball/methods/ray_method.h"
#include "metaball/parallel.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"
#include "metaball/tile_binning.h"

namespace sherd {
namespace {

class RayMethodRenderer final : public Renderer {
 public:
  RayMethodRenderer(std::string name, std::unique_ptr<RayMethod> method)
      : name_(std::move(name)), method_(std::move(method)) {}

  std::string backend() const override { return "cpu"; }
  std::string device() const override { return DeviceFor(0); }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    if (NeedsDeferredPasses(scene, settings.planes)) {
      return RenderDeferred(this, scene, camera, settings, control);
    }
    CheckRenderInput(scene, camera, settings);
    if (settings.planes.NeedGather()) {
      throw Error("this method sums up no channels and no other planes than its own");
    }
    const MethodSurface surface = MethodSurfaceOf(scene);
    method_->Prepare(surface);
    if (settings.supersample > 1) {
      return RenderSupersampled(this, scene, camera, settings, control);
    }
    const Stopwatch total;
    Frame frame = BeginFrame(*this, DeviceFor(settings.threads), scene, camera, settings.planes);
    if (!scene.cloud->empty()) {
      TraceJob job = JobOf(scene, camera, &bins_, &frame);
      job.threshold_scale = 1.0;  // the methods' densities have their own amplitudes
      BinMetaballs(job, settings.threads, control, &bins_, &frame.stats);
      const Stopwatch trace;
      Trace(job, surface, settings.threads, control);
      frame.stats.seconds_trace = trace.Seconds();
    }
    frame.stats.seconds_total = total.Seconds();
    return frame;
  }

 private:
  std::string DeviceFor(int threads) const { return ThreadsAnd(threads, name_); }

  void Trace(const TraceJob& job, const MethodSurface& surface, int threads,
             const Control& control) const {
    struct alignas(64) Worker {
      TraceCounts counts;
      RayField field;
    };
    Frame& frame = *job.frame;
    std::vector<Worker> workers(ThreadCount(threads));
    const int tiles = bins_.tiles_x() * bins_.tiles_y();
    std::atomic<int> done{0};
    ParallelFor(tiles, threads, [&](std::int64_t tile, int worker_idx) {
      Worker& worker = workers[worker_idx];
      const TileList list = job.ListOf(static_cast<int>(tile));
      const PixelBox pixels = bins_.PixelsOf(static_cast<int>(tile));
      const int y1 = list.count > 0 ? pixels.y1 : pixels.y0;
      for (int y = pixels.y0; y < y1; ++y) {
        control.ThrowIfStopped();
        for (int x = pixels.x0; x < pixels.x1; ++x) {
          const RayD ray = RayThrough(job.camera, x + 0.5, y + 0.5);
          worker.field.Start(list, ray, surface);
          const std::optional<double> depth =
              method_->FirstCrossing(&worker.field, &worker.counts.rays);
          if (!depth) continue;
          ++worker.counts.hits;
          if (*depth == 0) ++worker.counts.rays.started_inside;
          WriteHit(*job.cloud, job.light, ray, *depth,
                   Gather(*job.cloud, worker.field, ray, *depth),
                   static_cast<std::size_t>(y) * frame.width + x, &frame);
        }
      }
      const int finished = ++done;
      if (worker_idx == 0 && finished % 64 == 0) {
        control.Report("tracing", static_cast<double>(finished) / tiles);
      }
    });
    for (const Worker& worker : workers) AddCounts(worker.counts, &frame.stats);
  }

  static HitSums Gather(const Cloud& cloud, const RayField& field, const RayD& ray, double depth) {
    const Vec3d point = ray.origin + ray.direction * depth;
    const ThresholdMode mode = field.surface().mode;
    HitSums sums;
    Vec3d outward_of_thresholds{};
    double highest = -INFINITY;
    for (const RayMetaball& m : field.active()) {
      const double u = m.At(depth);
      if (!(u < 1)) continue;
      // The gradient's direction.
      const double slope = field.density().Slope(u) * m.inverse_radius * m.inverse_radius;
      const Vec3d offset = point - cloud.center[m.idx].cast<double>();
      const double f = field.density().Value(u);
      if (mode == ThresholdMode::kGated) {  // the metaball whose sphere this is, alone
        if (!(f - m.threshold > highest)) continue;
        highest = f - m.threshold;
        sums = {};
      }
      sums.Add(LinearFromRgb8(cloud.ColorOf(m.idx)), m.idx, f, offset * -slope);
      outward_of_thresholds += offset * (-slope * m.threshold);
    }
    if (mode == ThresholdMode::kBlended) {  // grad (A - B / A) where it is 0, times A
      sums.outward = sums.outward * (2 * sums.weight) - outward_of_thresholds;
    }
    return sums;
  }

  std::string name_;
  std::unique_ptr<RayMethod> method_;
  TileBins bins_;
};

}  // namespace

std::unique_ptr<Renderer> MakeRayMethodRenderer(std::string name,
                                                std::unique_ptr<RayMethod> method) {
  return std::make_unique<RayMethodRenderer>(std::move(name), std::move(method));
}

double Bisect(const RayField& field, double t0, double t1, double width) {
  while (t1 - t0 > width) {
    const double middle = 0.5 * (t0 + t1);
    if (!(middle > t0 && middle < t1)) break;
    (field.Excess(middle) >= 0 ? t1 : t0) = middle;
  }
  return t1;
}

}  // namespace sherd
