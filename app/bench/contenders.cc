#include "app/bench/contenders.h"

#include <cstdio>
#include <utility>

#include "cuda/cuda_thesis_renderer.h"
#include "cuda/device_query.h"
#include "cuda/renderers.h"
#include "metaball/cpu_renderer.h"
#include "metaball/precision.h"

namespace sherd {
namespace {

std::string Number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", v);
  return text;
}

void AddOurs(const Scene& scene, const DeviceChoice& choice, std::vector<Contender>* list) {
  const bool doubles = HasWideRadii(*scene.cloud) || HasStiffThreshold(scene.surface);
  const std::string precision = doubles ? "double" : "float";
  list->push_back(
      {"ours", "ours, scalar", "scalar", precision, "cpu", MakeCpuRenderer(CpuPath::kScalar)});
  list->push_back(
      {"ours", "ours, vectors", "vectors", precision, "cpu", MakeCpuRenderer(CpuPath::kBest)});
  if (auto gpu = MakeGpuRenderer(choice)) {
    list->push_back({"ours", "ours, CUDA", "CUDA", precision, "cuda", std::move(gpu)});
  }
}

// On the GPU that ours is measured on.
void AddThesisOnGpu(const DeviceChoice& choice, std::vector<Contender>* list) {
  const CudaDevice gpu = choice.gpu < 0
                             ? FirstUsableGpu()
                             : ListGpus().devices.at(static_cast<std::size_t>(choice.gpu));
  for (const bool gated : {true, false}) {
    for (const auto& [precision, name] : {std::pair{ThesisPrecision::kFloat, "float"},
                                          std::pair{ThesisPrecision::kDouble, "double"}}) {
      list->push_back({"thesis", "thesis, CUDA",
                       std::string("depth 7, step 0.1, ") + (gated ? "gated" : "not gated"), name,
                       "cuda", MakeCudaThesisRenderer(gpu, {.gated = gated}, precision)});
    }
  }
}

}  // namespace

std::unique_ptr<Renderer> MakeGpuRenderer(const DeviceChoice& choice) {
  if (choice.backend == Backend::kAuto && !QueryCuda().available) return nullptr;
  return MakeRenderer({Backend::kCuda, choice.gpu});
}

std::vector<Contender> MakeContenders(Method method, const Scene& scene,
                                      const DeviceChoice& choice) {
  std::vector<Contender> list;
  const std::string name(NameOf(method));
  const auto add = [&](const std::string& series, const std::string& parameter,
                       const MethodOptions& options) {
    const std::string precision = options.single_precision ? "float" : "double";
    list.push_back(
        {name, series, parameter, precision, "cpu", MakeMethodRenderer(method, options)});
  };
  switch (method) {
    case Method::kOurs:
      AddOurs(scene, choice, &list);
      break;
    case Method::kThesis:
      for (const bool gated : {true, false}) {
        const std::string series = gated ? "thesis, gated" : "thesis, not gated";
        for (const int depth : {5, 6, 7}) {
          const std::string at = "depth " + std::to_string(depth) + ", step ";
          add(series, at + "0.1", {.step = 0.1, .thesis_depth = depth, .thesis_gated = gated});
        }
        add(series, "depth 6, step 0.03", {.step = 0.03, .thesis_depth = 6, .thesis_gated = gated});
      }
      if (QueryCuda().available) AddThesisOnGpu(choice, &list);
      break;
    case Method::kFixedMarch:
    case Method::kAdaptiveMarch:
      for (const double step : {0.3, 0.1, 0.03, 0.01}) {
        add(method == Method::kFixedMarch ? "fixed march" : "adaptive march",
            "step " + Number(step), {.step = step});
      }
      break;
    case Method::kSphereTracing:
      for (const double tolerance : {1e-2, 1e-3, 5e-5}) {
        add("sphere tracing", "tolerance " + Number(tolerance), {.tolerance = tolerance});
      }
      break;
    case Method::kInterval:
      for (const bool single : {false, true}) {
        for (const double tolerance : {1e-2, 1e-3, 5e-5}) {
          add(single ? "interval, floats" : "interval, doubles", "tolerance " + Number(tolerance),
              {.tolerance = tolerance, .single_precision = single});
        }
      }
      break;
    case Method::kPolynomial:
      add("polynomial", "", {});
      break;
  }
  return list;
}

std::vector<Contender> MakeContenders(const std::vector<Method>& methods, const Scene& scene,
                                      const DeviceChoice& choice) {
  std::vector<Contender> all;
  for (const Method method : methods.empty() ? AllMethods() : methods) {
    for (Contender& contender : MakeContenders(method, scene, choice)) {
      all.push_back(std::move(contender));
    }
  }
  return all;
}

const std::vector<std::string>& AllSeries() {
  static const std::vector<std::string> series = {
      "ours, vectors",     "ours, scalar",     "ours, CUDA",        "thesis, gated",
      "fixed march",       "adaptive march",   "thesis, not gated", "sphere tracing",
      "interval, doubles", "interval, floats", "polynomial",        "thesis, CUDA"};
  return series;
}

}  // namespace sherd
