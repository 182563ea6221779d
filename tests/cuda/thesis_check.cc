#include "thesis_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>

#include "cuda/cuda_thesis_renderer.h"
#include "cuda/renderers.h"
#include "metaball/precision.h"

namespace sherd {
namespace {

// Shares of the drawn pixels that may differ.
constexpr double kDoublesOnDevice = 0.001, kFloats = 0.002;

double SmallestRadius(const Scene& scene) {
  const Cloud& cloud = *scene.cloud;
  double smallest = cloud.uniform_radius;
  if (!cloud.radius.empty()) {
    smallest = *std::min_element(cloud.radius.begin(), cloud.radius.end());
  }
  return smallest * cloud.frame.unit * scene.surface.radius_scale;
}

void Compare(const Frame& frame, const Frame& cpu, const Scene& scene, ThesisCheck* check) {
  const double near = 0.01 * SmallestRadius(scene);
  for (std::size_t i = 0; i < cpu.id.size(); ++i) {
    const bool hit = frame.id[i] >= 0, cpu_hit = cpu.id[i] >= 0;
    if (cpu_hit) ++check->drawn;
    if (!hit && !cpu_hit) continue;
    const double depth = frame.depth[i], cpu_depth = cpu.depth[i];  // infinite where the world is
    // Half a step of the plane's floats on either side is the plane's, not the method's.
    const bool together =
        depth == cpu_depth || std::abs(depth - cpu_depth) <= near + 2e-7 * cpu_depth;
    if (hit != cpu_hit || !together) {
      ++check->elsewhere;
      continue;
    }
    const Pixel &p = frame.color[i], &q = cpu.color[i];
    const float worst = std::max({std::abs(p.r - q.r), std::abs(p.g - q.g), std::abs(p.b - q.b)});
    if (!(worst <= 8.0f / 255)) ++check->color_off;
  }
}

std::unique_ptr<Renderer> MakeThesis(const std::string& backend, ThesisPrecision precision) {
  if (backend == "cuda") return MakeCudaThesisRenderer(FirstUsableGpu(), {}, precision);
  return MakeHostLoopThesisRenderer({}, precision);
}

}  // namespace

std::vector<ThesisCheck> CheckThesis(const CheckScene& scene, const std::string& backend) {
  RenderSettings settings;
  settings.supersample = scene.supersample;
  settings.planes.depth = settings.planes.id = true;
  const Frame cpu = MakeThesisRenderer()->Render(scene.scene, scene.camera, settings);
  const bool doubles_alone =
      HasWideRadii(*scene.scene.cloud) || HasStiffThreshold(scene.scene.surface);
  std::vector<ThesisCheck> checks;
  for (const ThesisPrecision precision : {ThesisPrecision::kDouble, ThesisPrecision::kFloat}) {
    const bool doubles = precision == ThesisPrecision::kDouble;
    if (!doubles && doubles_alone) continue;
    ThesisCheck check;
    check.scene = scene.name;
    check.backend = backend;
    check.precision = doubles ? "double" : "float";
    try {
      const Frame frame =
          MakeThesis(backend, precision)->Render(scene.scene, scene.camera, settings);
      check.seconds = frame.stats.seconds_total;
      Compare(frame, cpu, scene.scene, &check);
      const double share = !doubles ? kFloats : backend == "cuda" ? kDoublesOnDevice : 0.0;
      check.allowed = static_cast<std::uint64_t>(std::ceil(share * check.drawn));
      check.passed = check.elsewhere + check.color_off <= check.allowed;
    } catch (const std::exception& error) {
      check.error = error.what();
    }
    checks.push_back(check);
  }
  return checks;
}

void Print(const ThesisCheck& check) {
  std::printf("%-4s thesis: %-30s %-9s %-6s ", check.passed ? "ok" : "FAIL", check.scene.c_str(),
              check.backend.c_str(), check.precision.c_str());
  if (!check.error.empty()) {
    std::printf("%s\n", check.error.c_str());
    return;
  }
  std::printf("of %llu elsewhere %llu off %llu, %.1f ms\n",
              static_cast<unsigned long long>(check.drawn),
              static_cast<unsigned long long>(check.elsewhere),
              static_cast<unsigned long long>(check.color_off), check.seconds * 1e3);
  std::fflush(stdout);
}

void Write(const ThesisCheck& check, JsonWriter* json) {
  json->BeginObject()
      .Field("scene", check.scene)
      .Field("backend", check.backend)
      .Field("precision", check.precision)
      .Field("passed", check.passed);
  if (!check.error.empty()) {
    json->Field("error", check.error).EndObject();
    return;
  }
  json->Field("pixels_drawn_by_the_cpu", check.drawn)
      .Field("pixels_drawn_elsewhere", check.elsewhere)
      .Field("pixels_off_by_more_than_8_255", check.color_off)
      .Field("pixels_allowed_to_differ", check.allowed)
      .Field("seconds_total", check.seconds)
      .EndObject();
}

}  // namespace sherd
