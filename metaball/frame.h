// A finished picture and what it cost.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metaball/vec.h"

namespace sherd {

// Every figure of a render. Rare events are counted here, never silent.
struct RenderStats {
  std::string backend;  // "cpu" or "cuda"
  std::string device;   // e.g. "2 threads, AVX-512"
  std::uint64_t metaballs = 0;
  std::uint64_t metaballs_in_view = 0;  // binned into at least one tile
  std::uint64_t tile_entries = 0;       // metaball-tile pairs
  std::uint64_t rays = 0;
  std::uint64_t hits = 0;
  std::uint64_t rays_started_inside = 0;  // F >= threshold at the ray's start: a hit at depth 0
  std::uint64_t grazing = 0;     // passed within the tolerance of the threshold and taken as a miss
  std::uint64_t unresolved = 0;  // the iteration bound was reached: the pixel may be wrong
  double seconds_prepare = 0;    // transfer and per-frame constants
  double seconds_bin = 0;
  double seconds_trace = 0;  // crossing and shading
  double seconds_total = 0;
  std::uint64_t bytes = 0;  // working memory of the renderer at its peak, the cloud excluded

  RenderStats& operator+=(
      const RenderStats& other);  // sums counts and times (pictures made in parts)
};

struct Pixel {
  float r = 0, g = 0, b = 0,
        a = 0;  // linear light, alpha premultiplied (a is 0 or 1 before filtering)
};

struct Frame {
  int width = 0, height = 0;
  std::vector<Pixel> color;      // row-major from the upper-left pixel; always present
  std::vector<float> depth;      // distance along the ray in world units, 0 where nothing is hit
  std::vector<Vec3f> normal;     // unit, world axes, towards the outside; zero where nothing is hit
  std::vector<std::int32_t> id;  // the metaball with the largest density at the hit; -1 for none
  RenderStats stats;
};

// Which planes besides colour a caller wants; those left out cost nothing.
struct Planes {
  bool depth = false, normal = false, id = false;
};

}  // namespace sherd
