#include "metaball/thesis/thesis_renderer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <vector>

#include "metaball/error.h"
#include "metaball/frame_work.h"
#include "metaball/local_view.h"
#include "metaball/parallel.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"
#include "metaball/thesis/thesis_search.h"
#include "metaball/trace_job.h"

namespace sherd {
namespace {

class ThesisRenderer final : public Renderer {
 public:
  explicit ThesisRenderer(const ThesisOptions& options) : options_(options) {}

  std::string backend() const override { return "cpu"; }
  std::string device() const override { return DeviceFor(0); }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    CheckRenderInput(scene, camera, settings);
    if (settings.supersample > 1) {
      return RenderSupersampled(this, scene, camera, settings, control);
    }
    const Stopwatch total;
    Frame frame = BeginFrame(*this, DeviceFor(settings.threads), scene, camera, settings.planes);
    const Cloud& cloud = *scene.cloud;
    frame.stats.metaballs_in_view = cloud.size();  // nothing is culled by the view
    if (!cloud.empty()) {
      BuildOctree(scene, control);
      frame.stats.seconds_prepare = total.Seconds();
      frame.stats.bytes = octree_.MemoryBytes();
      const Stopwatch trace;
      Trace(PrepareThesisFrame(scene, octree_, options_), LocalCamera(camera, cloud.frame),
            PrepareLight(scene.lighting), settings.threads, control, &frame);
      frame.stats.seconds_trace = trace.Seconds();
    }
    frame.stats.seconds_total = total.Seconds();
    return frame;
  }

 private:
  static constexpr int kBlock = 16;  // pixels a side of what a thread takes at once

  std::string DeviceFor(int threads) const {
    return ThreadsAnd(threads, "thesis, octree depth " + std::to_string(options_.depth));
  }

  void BuildOctree(const Scene& scene, const Control& control) {
    const Cloud& cloud = *scene.cloud;
    double largest = cloud.uniform_radius;
    for (const float r : cloud.radius) largest = std::max(largest, static_cast<double>(r));
    const double margin =
        largest * scene.surface.radius_scale * ResolveDensity(scene.surface.density).support;
    if (built_for_ == scene.cloud && built_margin_ == margin) return;
    built_for_ = nullptr;
    control.Report("building the octree", 0.0);
    octree_.Build(cloud, margin, options_.depth, control);
    built_for_ = scene.cloud;
    built_margin_ = margin;
  }

  static void Trace(const ThesisFrame& thesis, const Camera& local, const FrameLight& light,
                    int threads, const Control& control, Frame* frame) {
    struct alignas(64) Worker {
      TraceCounts counts;
    };
    std::vector<Worker> workers(ThreadCount(threads));
    std::vector<ThesisSearch> searches(workers.size(), ThesisSearch(thesis));
    const int columns = (frame->width + kBlock - 1) / kBlock;
    const int rows = (frame->height + kBlock - 1) / kBlock;
    const int blocks = columns * rows;
    std::atomic<int> done{0};
    ParallelFor(blocks, threads, [&](std::int64_t block, int worker) {
      ThesisSearch& search = searches[worker];
      TraceCounts& counts = workers[worker].counts;
      const int x0 = static_cast<int>(block % columns) * kBlock;
      const int y0 = static_cast<int>(block / columns) * kBlock;
      for (int y = y0; y < std::min(y0 + kBlock, frame->height); ++y) {
        control.ThrowIfStopped();
        for (int x = x0; x < std::min(x0 + kBlock, frame->width); ++x) {
          const RayD ray = RayThrough(local, x + 0.5, y + 0.5);
          const std::optional<double> depth = search.Trace(ray, &counts.rays);
          if (!depth) continue;
          ++counts.hits;
          WriteHit(*thesis.cloud, light, ray, *depth, search.Gather(*depth),
                   static_cast<std::size_t>(y) * frame->width + x, frame);
        }
      }
      const int finished = ++done;
      if (worker == 0) control.Report("tracing", static_cast<double>(finished) / blocks);
    });
    for (const Worker& w : workers) AddCounts(w.counts, &frame->stats);
  }

  ThesisOptions options_;
  MortonOctree octree_;
  std::shared_ptr<const Cloud> built_for_;
  double built_margin_ = 0.0;
};

}  // namespace

std::unique_ptr<Renderer> MakeThesisRenderer(const ThesisOptions& options) {
  if (options.depth < 1 || options.depth > kOctreeMaxDepth) {
    throw Error("the octree's depth must lie between 1 and 10");
  }
  if (!(options.step > 0) || !std::isfinite(options.step) || !(options.tolerance > 0) ||
      !std::isfinite(options.tolerance)) {
    throw Error("the step and the tolerance of marching must be positive");
  }
  return std::make_unique<ThesisRenderer>(options);
}

}  // namespace sherd
