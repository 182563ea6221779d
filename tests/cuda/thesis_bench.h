// Ours against the thesis's method on the same GPU: time and error.
#pragma once

#include <string>

#include "datasets_synthetic/peer_scenes.h"
#include "json_writer.h"

namespace sherd {

// Writes one object: our renderer and the thesis's (octree depth 7, floats, with and without its
// gate), frame about frame with moving cameras. Medians of whole frames to the host's memory, of
// which the first does not count, nor does what a renderer prepares once; the ratio of the thesis's
// to ours; both errors against the reference, on a small picture of the same view. frames: >= 1.
// Throws DeviceError without a GPU.
void MeasureThesis(const std::string& name, const PeerScene& peer, int frames, JsonWriter* json);

}  // namespace sherd
