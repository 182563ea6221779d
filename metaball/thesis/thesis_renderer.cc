#include "metaball/thesis/thesis_renderer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "metaball/appearance/deferred.h"
#include "metaball/cloud_version.h"
#include "metaball/error.h"
#include "metaball/frame_work.h"
#include "metaball/local_view.h"
#include "metaball/parallel.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"
#include "metaball/thesis/octree.h"
#include "metaball/thesis/thesis_frame.h"
#include "metaball/thesis/thesis_search.h"
#include "metaball/trace_job.h"

namespace sherd {
namespace {

// The metaballs of a cloud in the order of an octree's lists.
struct CloudMetaballs {
  static constexpr bool kOwn = true;

  struct Metaball {
    Vec3f middle;
    float radius;
    const Vec3f& center() const { return middle; }
  };

  const Cloud* cloud = nullptr;
  const std::uint32_t* order = nullptr;  // indices into the cloud
  bool own_threshold = false;            // Cloud::threshold counts

  std::uint32_t IndexOf(std::uint32_t place) const { return order[place]; }
  Metaball Read(std::uint32_t place) const {
    const std::uint32_t i = order[place];
    return {cloud->center[i], cloud->RadiusOf(i)};
  }
  double ThresholdOf(std::uint32_t place, double otherwise) const {
    return own_threshold ? static_cast<double>(cloud->threshold[order[place]]) : otherwise;
  }
  Vec3f LinearColorOf(std::uint32_t place) const {
    return LinearFromRgb8(cloud->ColorOf(order[place]));
  }
};

// As much as it takes.
struct GrowingStore {
  static constexpr std::uint32_t kRoom = std::numeric_limits<std::uint32_t>::max();
  using Taken = ThesisTaken<double, CloudMetaballs::kOwn>;

  std::vector<Taken> taken;

  void Set(std::uint32_t k, const Taken& value) {
    if (k < taken.size()) {
      taken[k] = value;
    } else {
      taken.push_back(value);
    }
  }
  const Taken& operator[](std::uint32_t k) const { return taken[k]; }
};

class ThesisRenderer final : public Renderer {
 public:
  explicit ThesisRenderer(const ThesisOptions& options) : options_(options) {}

  std::string backend() const override { return "cpu"; }
  std::string device() const override { return DeviceFor(0); }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    if (NeedsDeferredPasses(scene, settings.planes)) {
      return RenderDeferred(this, scene, camera, settings, control);
    }
    CheckRenderInput(scene, camera, settings);
    if (settings.planes.NeedGather()) {
      throw Error("the thesis's method sums up no channels and no other planes than its own");
    }
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
      const DensityShape shape = ResolveDensity(scene.surface.density).shape;
      if (shape == DensityShape{}) {
        Trace(MurakamiShape{}, scene, camera, settings.threads, control, &frame);
      } else {
        Trace(AnyShape{shape}, scene, camera, settings.threads, control, &frame);
      }
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
    const double margin = ThesisMargin(LargestRadius(cloud), scene.surface);
    if (built_for_.Is(scene.cloud) && built_margin_ == margin) return;
    built_for_ = {};
    control.Report("building the octree", 0.0);
    octree_.Build(cloud, margin, options_.depth, control);
    built_for_ = CloudVersion(scene.cloud);
    built_margin_ = margin;
  }

  template <class Shape>
  void Trace(const Shape& shape, const Scene& scene, const Camera& camera, int threads,
             const Control& control, Frame* frame) const {
    using Search = ThesisSearch<double, Shape, CloudMetaballs, GrowingStore>;
    const Cloud& cloud = *scene.cloud;
    const Camera local = LocalCamera(camera, cloud.frame);
    const FrameLight light = PrepareLight(scene.lighting);
    const OctreeView<double> octree = octree_.View();
    const CloudMetaballs metaballs{&cloud, octree_.metaballs().data(), HasOwnThresholds(scene)};
    const ThesisDensity<double, Shape> density = ThesisDensityOf<double>(scene, shape);
    const ThesisRules<double> rules = ThesisRulesOf<double>(scene, options_);
    struct alignas(64) Worker {
      TraceCounts counts;
      GrowingStore store;
    };
    std::vector<Worker> workers(ThreadCount(threads));
    const int columns = (frame->width + kBlock - 1) / kBlock;
    const int rows = (frame->height + kBlock - 1) / kBlock;
    const int blocks = columns * rows;
    std::atomic<int> done{0};
    ParallelFor(blocks, threads, [&](std::int64_t block, int worker) {
      Search search(octree, metaballs, density, rules, &workers[worker].store);
      TraceCounts& counts = workers[worker].counts;
      const int x0 = static_cast<int>(block % columns) * kBlock;
      const int y0 = static_cast<int>(block / columns) * kBlock;
      for (int y = y0; y < std::min(y0 + kBlock, frame->height); ++y) {
        control.ThrowIfStopped();
        for (int x = x0; x < std::min(x0 + kBlock, frame->width); ++x) {
          const RayD ray = RayThrough(local, x + 0.5, y + 0.5);
          const double depth = search.Trace(ray.origin, ray.direction, &counts.rays);
          if (!(depth >= 0)) continue;
          ++counts.hits;
          if (depth == 0) ++counts.rays.started_inside;
          WriteHit(cloud, light, ray, depth, search.Gather(depth),
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
  CloudVersion built_for_;
  double built_margin_ = 0.0;
};

}  // namespace

void CheckThesisOptions(const ThesisOptions& options) {
  if (options.depth < 1 || options.depth > kOctreeMaxDepth) {
    throw Error("the octree's depth must lie between 1 and 10");
  }
  if (!(options.step > 0) || !std::isfinite(options.step) || !(options.tolerance > 0) ||
      !std::isfinite(options.tolerance)) {
    throw Error("the step and the tolerance of marching must be positive");
  }
}

std::unique_ptr<Renderer> MakeThesisRenderer(const ThesisOptions& options) {
  CheckThesisOptions(options);
  return std::make_unique<ThesisRenderer>(options);
}

}  // namespace sherd
