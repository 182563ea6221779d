// One of the two peer scenes at one size: frames, the first frame, and the CPU beside it.
#pragma once

#include <string>

#include "bench_backend.h"
#include "bench_options.h"
#include "datasets_synthetic/peer_scenes.h"
#include "json_writer.h"
#include "reference_error.h"

namespace sherd {

// Each writes one object, and nothing where it throws: ResourceError, DeviceError. `name` is the
// scene's; the camera of `peer` has the size that is measured.

// Frames one after another and the kernels in them. count_work: with the operations a frame
// consists of, counted by the host loop, which takes its time.
void MeasureFrames(const BenchBackend& backend, const std::string& name, const PeerScene& peer,
                   const BenchOptions& options, bool count_work, JsonWriter* json);

// From the wish for a picture of a cloud in the host's memory to the picture in the host's memory:
// a renderer is made, the cloud brought over and a frame drawn. Several times, each time by a new
// renderer, after one that draws a tiny scene of the same kind: whoever draws at all has done that.
void MeasureFirstFrame(const BenchBackend& backend, const std::string& name, const PeerScene& peer,
                       JsonWriter* json);

// The CPU renderer on the same machine, frame about frame with the backend's, and the errors of
// both against the reference (of that scene).
void MeasureAgainstTheCpu(const BenchBackend& backend, const std::string& name,
                          const PeerScene& peer, const SmallReference& reference, JsonWriter* json);

}  // namespace sherd
