#include "app/bench/measure.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "metaball/error.h"

namespace sherd {

double ProcessCpuSeconds() {
  rusage usage;
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

FrameTime TimeFrame(Renderer* renderer, const Scene& scene, const Camera& camera,
                    const RenderSettings& settings, int repeat, const Control& control,
                    Frame* last) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> wall, cpu;
  // The first frame allocates, builds trees that later ones keep and loads kernels.
  Frame frame = renderer->Render(scene, camera, settings, control);
  for (int i = 0; i < repeat; ++i) {
    renderer->Recycle(std::move(frame));
    const double cpu_start = ProcessCpuSeconds();
    const Clock::time_point start = Clock::now();
    frame = renderer->Render(scene, camera, settings, control);
    wall.push_back(std::chrono::duration<double>(Clock::now() - start).count());
    cpu.push_back(ProcessCpuSeconds() - cpu_start);
  }
  std::sort(wall.begin(), wall.end());
  std::sort(cpu.begin(), cpu.end());
  if (last) *last = std::move(frame);
  return {wall[wall.size() / 2], wall.front(), cpu[cpu.size() / 2]};
}

Measurement Measure(const Contender& contender, const Scene& scene, const Camera& camera,
                    const ReferenceFrame& reference, int threads, int repeat,
                    const Control& control) {
  Measurement m;
  m.method = contender.method;
  m.series = contender.series;
  m.parameter = contender.parameter;
  m.precision = contender.precision;
  m.backend = contender.backend;
  RenderSettings settings;
  settings.planes.depth = settings.planes.normal = true;
  settings.threads = threads;
  try {
    Frame frame;
    m.seconds =
        TimeFrame(contender.renderer.get(), scene, camera, settings, repeat, control, &frame);
    m.device = frame.stats.device;
    m.rays_per_second = static_cast<double>(frame.stats.rays) / m.seconds.wall;
    m.bytes = frame.stats.bytes;
    m.grazing = frame.stats.grazing;
    m.unresolved = frame.stats.unresolved;
    m.difference = CompareToReference(frame, reference, scene.cloud->frame.unit);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    m.error = error.what();
  }
  return m;
}

}  // namespace sherd
