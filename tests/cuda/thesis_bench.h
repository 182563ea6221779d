// Ours against the thesis's method on the same backend: time and error.
#pragma once

#include <string>

#include "bench_backend.h"
#include "bench_options.h"
#include "datasets_synthetic/peer_scenes.h"
#include "json_writer.h"
#include "reference_error.h"

namespace sherd {

// Writes one object: our renderer and the thesis's (octree depth 7, floats, with and without its
// gate), frame about frame with moving cameras. Medians of whole frames to the host's memory, of
// which the first does not count, nor does what a renderer prepares once; the ratio of the thesis's
// to ours; both errors against the reference, on a small picture of the same view. Nothing is
// written where it throws: ResourceError, DeviceError.
void MeasureThesis(const BenchBackend& backend, const std::string& name, const PeerScene& peer,
                   const SmallReference& reference, const BenchOptions& options, JsonWriter* json);

}  // namespace sherd
