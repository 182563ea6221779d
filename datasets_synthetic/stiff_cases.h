// Stiff and extreme scenes, each with what must come out: one table for the tests of every backend
// and for `sherd bench --stability`.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/frame_difference.h"
#include "metaball/renderer.h"
#include "metaball/scene.h"

namespace sherd {

struct StiffCase {
  enum class Expect {
    kReference,  // the picture of the double-precision reference
    kNothing,    // no pixel hit
    kAllInside,  // every ray starts inside: a hit at depth 0, counted
    kRefused,    // an Error, and no picture
  };

  std::string name;
  std::string expects;  // for people: what must come out
  Scene scene;
  Camera camera;
  Expect expect = Expect::kReference;
  // Largest depth error allowed, in radii of the smallest support at the hit: the contract's,
  // unless the float depth plane itself cannot hold it.
  double depth_tolerance = 1e-4;
  // Largest angle between normals, degrees.
  double normal_tolerance_deg = 0.1;
  // Metaballs that must be left of those given.
  std::size_t metaballs = 0;
};

// In the order of the table. Deterministic.
std::vector<StiffCase> MakeStiffCases();

struct StiffOutcome {
  bool passed = false;
  std::string what;       // what came out, in one line
  FrameDifference error;  // where Expect::kReference
  RenderStats stats;      // where something was drawn
};

// Draws the case and judges it. The reference's picture is made anew each time.
StiffOutcome RunStiffCase(const StiffCase& stiff, Renderer* renderer);
// The same against a picture of the reference that is at hand (MakeReference).
StiffOutcome RunStiffCase(const StiffCase& stiff, Renderer* renderer,
                          const ReferenceFrame& reference);
// Empty where the case is not compared with the reference.
ReferenceFrame MakeReference(const StiffCase& stiff);

}  // namespace sherd
