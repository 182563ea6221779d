#include "cuda/device_choice.h"

#include <charconv>
#include <string_view>
#include <utility>
#include <vector>

#include "cuda/fallback.h"
#include "cuda/shared_renderer.h"
#include "metaball/error.h"

namespace sherd {
namespace {

constexpr std::string_view kCudaPrefix = "cuda:";

struct Started {
  std::unique_ptr<Renderer> renderer;  // null where no GPU can be used
  std::string numbers;                 // of the GPUs that draw: "0, 2"
  std::string refused;                 // why others could not
};

// Starts the first candidate that can be used, or all that can.
Started Start(const std::vector<CudaDevice>& candidates, bool all, const GpuFactory& make_gpu) {
  Started started;
  std::vector<std::unique_ptr<Renderer>> renderers;
  for (const CudaDevice& device : candidates) {
    std::string why_not = device.why_not;
    if (why_not.empty()) {
      try {
        renderers.push_back(make_gpu(device));
        started.numbers += (started.numbers.empty() ? "" : ", ") + std::to_string(device.idx);
        if (!all) break;
        continue;
      } catch (const Error& error) {
        why_not = error.what();
      }
    }
    started.refused += (started.refused.empty() ? "" : "; ") + device.Label() + ": " + why_not;
  }
  if (renderers.size() == 1) started.renderer = std::move(renderers.front());
  if (renderers.size() > 1) started.renderer = MakeSharedRenderer(std::move(renderers));
  return started;
}

std::vector<CudaDevice> CandidatesOf(const DeviceChoice& choice, const GpuList& gpus) {
  if (choice.backend != Backend::kCuda || choice.gpu < 0) return gpus.devices;
  for (const CudaDevice& device : gpus.devices) {
    if (device.idx == choice.gpu) return {device};
  }
  const std::string missing = "there is no GPU " + std::to_string(choice.gpu) + ": ";
  throw DeviceError(
      "CUDA", 0,
      missing +
          (gpus.devices.empty() ? gpus.reason : "this machine has " + LabelsOf(gpus.devices)));
}

std::string NoneCanBeUsed(const std::string& reasons) { return "no GPU can be used: " + reasons; }

}  // namespace

DeviceChoice ParseDeviceChoice(const std::string& text) {
  if (text == "auto") return {Backend::kAuto};
  if (text == "cpu") return {Backend::kCpu};
  if (text == "cuda") return {Backend::kCuda};
  if (text.starts_with(kCudaPrefix)) {
    const std::string_view which = std::string_view(text).substr(kCudaPrefix.size());
    if (which == "all") return {Backend::kCuda, DeviceChoice::kAll};
    int gpu = 0;
    const auto [end, code] = std::from_chars(which.data(), which.data() + which.size(), gpu);
    if (code == std::errc() && end == which.data() + which.size() && gpu >= 0) {
      return {Backend::kCuda, gpu};
    }
    throw InputError("", "", "'" + std::string(which) + "' is not a GPU",
                     "give a number that sherd devices lists, or all");
  }
  throw InputError("", "", "there is no backend '" + text + "'", "use auto, cpu or cuda");
}

std::string DeviceChoice::Text() const {
  if (backend == Backend::kAuto) return "auto";
  if (backend == Backend::kCpu) return "cpu";
  if (gpu == kFirst) return "cuda";
  return std::string(kCudaPrefix) + (gpu == kAll ? "all" : std::to_string(gpu));
}

std::unique_ptr<Renderer> ChooseRenderer(const DeviceChoice& choice, const GpuList& gpus,
                                         const GpuFactory& make_gpu, std::string* why) {
  const auto say = [why](std::string line) {
    if (why) *why = std::move(line);
  };
  const auto on_cpu = [&say](const std::string& because) {
    auto renderer = MakeCpuRenderer();
    say("CPU (" + renderer->device() + ")" + because);
    return renderer;
  };
  if (choice.backend == Backend::kCpu) return on_cpu(", as asked for");

  const bool asked = choice.backend == Backend::kCuda;
  const bool all = asked && choice.gpu == DeviceChoice::kAll;
  const std::vector<CudaDevice> candidates = CandidatesOf(choice, gpus);
  Started started = Start(candidates, all, make_gpu);
  if (!started.renderer) {
    const std::string reasons = candidates.empty() ? gpus.reason : started.refused;
    if (!asked) return on_cpu(": " + reasons);
    throw DeviceError("CUDA", 0, NoneCanBeUsed(reasons) + "; auto and cpu draw without one");
  }
  say("GPU " + started.numbers + " (" + started.renderer->device() + ")" +
      (asked ? ", as asked for" : "") +
      (started.refused.empty() ? "" : "; not used: " + started.refused));
  return MakeFallbackRenderer(
      std::move(started.renderer),
      [candidates, all, make_gpu] {
        Started again = Start(candidates, all, make_gpu);
        if (!again.renderer) throw DeviceError("CUDA", 0, NoneCanBeUsed(again.refused));
        return std::move(again.renderer);
      },
      [] { return MakeCpuRenderer(); });
}

}  // namespace sherd
