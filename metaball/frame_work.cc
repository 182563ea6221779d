#include "metaball/frame_work.h"

#include <utility>

#include "metaball/density/model.h"
#include "metaball/local_view.h"
#include "metaball/parallel.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"

namespace sherd {

Frame BeginFrame(const Renderer& renderer, const std::string& device, const Scene& scene,
                 const Camera& camera, const Planes& planes, Frame spare) {
  Frame frame = MakeFrame(camera, planes, std::move(spare));
  frame.stats.backend = renderer.backend();
  frame.stats.device = device;
  frame.stats.metaballs = scene.cloud->size();
  frame.stats.rays = frame.color.size();
  return frame;
}

TraceJob JobOf(const Scene& scene, const Camera& camera, const TileBins* bins, Frame* frame) {
  const ResolvedDensity density = ResolveDensity(scene.surface.density);
  TraceJob job;
  job.cloud = scene.cloud.get();
  job.camera = LocalCamera(camera, scene.cloud->frame);
  job.bins = bins;
  job.light = PrepareLight(scene.lighting);
  job.shape = density.shape;
  job.mode = scene.surface.mode;
  job.threshold = scene.surface.threshold;
  job.threshold_scale = 1.0 / density.amplitude;
  job.radius_scale = scene.surface.radius_scale * density.support;
  job.frame = frame;
  return job;
}

void BinMetaballs(const TraceJob& job, int threads, const Control& control, TileBins* bins,
                  RenderStats* stats) {
  const Stopwatch watch;
  bins->Build(*job.cloud, static_cast<float>(job.radius_scale), ViewOf(job.camera), threads,
              control);
  stats->seconds_bin = watch.Seconds();
  stats->metaballs_in_view = bins->metaballs_in_view();
  stats->tile_entries = bins->entries();
  stats->bytes = bins->MemoryBytes();
}

void AddCounts(const TraceCounts& counts, RenderStats* stats) {
  stats->hits += counts.hits;
  stats->rays_started_inside += counts.rays.started_inside;
  stats->grazing += counts.rays.grazing;
  stats->unresolved += counts.rays.unresolved;
}

std::string ThreadsAnd(int threads, const std::string& what) {
  const int count = ThreadCount(threads);
  return std::to_string(count) + (count == 1 ? " thread, " : " threads, ") + what;
}

}  // namespace sherd
