// Photographs on a surface: the formulas on the CPU, and a backend with an empty store and with a
// filled one, kernel by kernel.
#pragma once

#include "bench_backend.h"
#include "json_writer.h"

namespace sherd {

// Writes one object: a picture of 1920 x 1080 of 250 thousand metaballs with 36 photographs of 11
// megapixels; on the host loop a small one. Nothing is written where it throws: ResourceError,
// DeviceError.
void MeasurePhotographs(const BenchBackend& backend, JsonWriter* json);

}  // namespace sherd
