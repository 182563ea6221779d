// What each feature of a scene costs.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "bench_backend.h"
#include "bench_options.h"
#include "json_writer.h"

namespace sherd {

// Runs one measurement; told its name, so that one which fails is left out.
using MeasureOne = std::function<void(const std::string& name, const std::function<void()>&)>;

// Writes one object for each feature of a height field of `count` metaballs at the first size: its
// frames, the kernels in them and the ratio to the plain scene's. A level of detail is drawn from
// far away, where a pixel holds many metaballs, beside the plain scene seen from there. Nothing is
// written of a feature that throws: ResourceError, DeviceError.
void MeasureFeatures(const BenchBackend& backend, std::uint64_t count, const BenchOptions& options,
                     const MeasureOne& measure, JsonWriter* json);

}  // namespace sherd
