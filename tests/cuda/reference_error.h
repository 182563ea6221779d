// How far a renderer's picture of a measured scene is from the double-precision reference.
#pragma once

#include "datasets_synthetic/peer_scenes.h"
#include "json_writer.h"
#include "metaball/frame_difference.h"
#include "metaball/reference/reference.h"
#include "metaball/renderer.h"

namespace sherd {

// The scene's view, small enough for a method that tries every metaball against every ray.
struct SmallReference {
  Camera camera;
  ReferenceFrame frame;
};
SmallReference MakeSmallReference(const PeerScene& peer);

// reference: of that scene.
FrameDifference ErrorOf(Renderer* renderer, const Scene& scene, const SmallReference& reference);

// One object.
void WriteError(const FrameDifference& error, JsonWriter* json);

}  // namespace sherd
