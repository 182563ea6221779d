// A finished picture and what it cost.
#pragma once

#include <cstddef>
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
  double seconds_prepare = 0;    // transfers, and what is made once and kept for further pictures
  double seconds_bin = 0;
  double seconds_trace = 0;  // crossing and shading
  double seconds_total = 0;
  std::uint64_t bytes = 0;  // working memory of the renderer at its peak, the cloud excluded
  // A level of detail, where one was asked for (lod_renderer.h).
  std::uint64_t lod_metaballs = 0;  // what was drawn instead of the cloud; 0: the cloud itself
  double lod_error_px = 0;          // bound of the error of what was drawn; 0: the cloud itself
  double lod_seconds = 0;           // choosing and making the level, part of seconds_total
  std::uint64_t lod_bytes = 0;      // of the levels made so far
  std::string lod_note;             // why none could be used; empty where one could

  // What a further picture like this one takes: what stands beside a level to be compared.
  double SecondsToDraw() const { return seconds_total - seconds_prepare; }

  RenderStats& operator+=(
      const RenderStats& other);  // sums counts and times (pictures made in parts)
};

struct Pixel {
  float r = 0, g = 0, b = 0,
        a = 0;  // linear light, alpha premultiplied (a is 0 or 1 before filtering)
};

// One channel of V at the hits, blended by the weights f_i / sum f (thesis 2.1.1, 3.1).
struct ChannelPlane {
  std::string name;
  int components = 1;         // 1..4
  std::vector<float> values;  // components a pixel, row-major; 0 where nothing is hit
};

// Where a hit lies in an image, and how fast that changes across space.
struct SurfaceUv {
  float u = 0, v = 0;
  Vec3f du{}, dv{};  // gradients per world unit, world axes; zero where they are not known
};

struct UvPlane {
  std::string channel;
  std::vector<SurfaceUv> values;  // row-major; zero where nothing is hit
};

struct Frame {
  int width = 0, height = 0;
  std::vector<Pixel> color;      // row-major from the upper-left pixel; always present
  std::vector<float> depth;      // distance along the ray in world units, 0 where nothing is hit
  std::vector<Vec3f> normal;     // unit, world axes, towards the outside; zero where nothing is hit
  std::vector<std::int32_t> id;  // the metaball with the largest density at the hit; -1 for none
  // What a hit's own colour is multiplied by, linear and before anything is cut off at 1: all
  // lights, shadows and ambient occlusion; 1 in an unlit scene, zero where nothing is hit.
  std::vector<Vec3f> light;
  // Further planes, each there only where it was asked for.
  std::vector<ChannelPlane> channels;
  std::vector<float> weight;     // F, the sum of the positive f, at the hit; 0 where none
  std::vector<float> intensity;  // sum f^2 / F (thesis 3.2); 0 where nothing is hit
  std::vector<Vec3f> influence;  // sum (f / F) (p - c) / |p - c| (thesis 3.5), not normalised
  std::vector<UvPlane> uv;
  RenderStats stats;

  // Takes back what was drawn in [x0, x1) x [y0, y1), in every plane; parts outside are left out.
  void Clear(int x0, int y0, int x1, int y1);
};

// Texture coordinates: a channel of two components, followed to the hit point itself where the
// cloud knows their gradients (metaball/appearance/uv_gradients.h).
struct UvRequest {
  std::string channel;
  bool periodic = false;  // both components wrap at 1 and are blended the short way round
  friend bool operator==(const UvRequest&, const UvRequest&) = default;
};

// Which planes besides colour a caller wants; those left out cost nothing.
struct Planes {
  bool depth = false, normal = false, id = false, light = false;
  bool weight = false, intensity = false, influence = false;
  std::vector<std::string> channels;  // of the cloud, by name, each once
  std::vector<UvRequest> uv;

  // Whether a tracer must look at the metaballs of each hit once more for what is wanted.
  bool NeedGather() const {
    return weight || intensity || influence || !channels.empty() || !uv.empty();
  }
  // Bytes of a frame's pixel with these planes; a channel is counted with four components.
  std::size_t BytesPerPixel() const;
};

}  // namespace sherd
