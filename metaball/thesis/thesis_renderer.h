// The source thesis's renderer, rebuilt to be compared with: it is not the default of anything.
//
// A ray steps through the finest nodes of an octree (octree.h) by algorithm 1. At each node it
// takes the metaballs of the node and its 26 neighbours, discards those the sphere test finds
// missed (thesis 2.11), solves a lone one directly and searches two or more by marching points with
// adaptive steps (Singh and Narayanan 2010). The first node that yields a crossing ends the search.
// Thresholds are gated: only positive f_k - T_k are added (algorithms 2-6).
//
// What is wrong with it, and kept:
// - The gate makes the surface a union of spheres: rough (thesis 4.10, 4.11).
// - A node sees no metaball further away than its neighbours, although its radius may reach into
//   it, and accepts crossings outside itself. So at the border of two nodes the search ends in the
//   wrong one: a lone metaball or an incomplete sum is drawn, as a small sphere or further away
//   than the surface (thesis figures 4.10-4.13). Of a metaball much larger than a node only what
//   lies in front of the nodes around its centre is found.
// - Marching steps over crossings thinner than its step.
// The thesis's domain is [0, 1]^3; here the octree fits the cloud. Where the thesis leaves the
// marching open, the rules are in thesis_search.h.
#pragma once

#include <memory>

#include "metaball/renderer.h"

namespace sherd {

struct ThesisOptions {
  int depth = 7;            // of the octree below its root, 1..10; seven levels in chapter 4
  bool gated = true;        // false: the thresholds as Surface::mode says, all else the same
  double step = 0.1;        // of marching points, in support radii of the smallest metaball; > 0
  double tolerance = 5e-5;  // the bracket in which a crossing is accepted, likewise; > 0
};

// Draws every density. T_k is Cloud::threshold where there is one, Surface::threshold otherwise and
// in ThresholdMode::kUniform. Throws Error for options out of range. The octree is built anew when
// the cloud or a radius changes (RenderStats::seconds_prepare). Written once for the CPU, in
// doubles here, and the GPU (cuda/cuda_thesis_renderer.h).
std::unique_ptr<Renderer> MakeThesisRenderer(const ThesisOptions& options = {});

// Throws Error for options out of range.
void CheckThesisOptions(const ThesisOptions& options);

}  // namespace sherd
