// Photographs looked up: the CPU, and a backend with an empty store and with a filled one.
#pragma once

#include "bench_backend.h"
#include "json_writer.h"

namespace sherd {

// Writes one object: a million lookups in eight pictures of 11 megapixels; on the host loop far
// fewer in smaller ones. Nothing is written where it throws: ResourceError, DeviceError.
void MeasurePhotographs(const BenchBackend& backend, JsonWriter* json);

}  // namespace sherd
