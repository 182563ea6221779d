// The ways to draw one frame that are measured against each other: every method over the range of
// what trades its error for time, each with its precision and backend.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cuda/device_choice.h"
#include "metaball/methods/methods.h"
#include "metaball/renderer.h"
#include "metaball/scene.h"

namespace sherd {

struct Contender {
  std::string method;     // NameOf(Method)
  std::string series;     // what belongs together in a plot: "thesis, gated"
  std::string parameter;  // "step 0.1"; empty where there is none
  std::string precision;  // "float" or "double"
  std::string backend;    // "cpu" or "cuda"
  std::unique_ptr<Renderer> renderer;
};

// The GPU that is measured beside the CPU: for kAuto the first, or null where there is none; for
// kCuda what is asked for. Throws DeviceError where that is not there.
std::unique_ptr<Renderer> MakeGpuRenderer(const DeviceChoice& choice);

// The contenders of one method, in the order of falling error. `scene` decides the precision our
// own renderer works in. The GPU takes part as MakeGpuRenderer says.
std::vector<Contender> MakeContenders(Method method, const Scene& scene,
                                      const DeviceChoice& choice = {});
// Of several methods; all of them where none is named.
std::vector<Contender> MakeContenders(const std::vector<Method>& methods, const Scene& scene,
                                      const DeviceChoice& choice = {});

// Every series there can be, in a fixed order: a plot's colours and marks follow it, whichever
// methods take part.
const std::vector<std::string>& AllSeries();

}  // namespace sherd
