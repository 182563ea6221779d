// What the trace kernel is given and gives back: its parameters, the features it is compiled for,
// the sums over a frame.
#pragma once

#include <cstdint>
#include <type_traits>

#include "cuda/kernels/binning.h"
#include "cuda/kernels/device_ops.h"
#include "cuda/kernels/packed_color.h"
#include "metaball/camera.h"
#include "metaball/frame.h"
#include "metaball/scene.h"
#include "metaball/shading.h"
#include "metaball/tile_march.h"

namespace sherd::kernels {

inline constexpr int kTileRays = kTileSize * kTileSize;
inline constexpr int kChunk = kTileRays;  // entries staged at once: one a thread
// How far from the base an entry may begin, in its own radii.
inline constexpr float kReachInRadii = 32.0f;
// The march's first step after a pause, in smallest radii.
inline constexpr float kFirstStepInRadii = 1.0f;
// Steps of one ray after which it is given up and counted as unresolved.
inline constexpr int kMaxSteps = 20000;

struct alignas(16) Vec4f {
  float x, y, z, w;
};

// Sums over a frame; all integers, so their order does not matter.
struct TraceCounts {
  enum Rare { kHits, kStartedInside, kGrazing, kUnresolved, kWide, kRareCount };
  enum Work { kTests, kAdds, kSteps, kStaged, kShadeAdds, kWorkCount };
  unsigned long long rare[kRareCount];
  unsigned long long work[kWorkCount];  // where kCountWork is asked for; else 0
};

// Which features a scene uses: the kernel is compiled for them alone.
template <ThresholdMode kModeV, bool kOwnRadiusV, bool kOwnColorV, class RealT, class ShapeT,
          bool kCountWorkV = false>
struct TraceTraits {
  static constexpr bool kBlended = kModeV == ThresholdMode::kBlended;  // else uniform
  using Shape = ShapeT;                            // of the density (metaball/density/shapes.h)
  static constexpr bool kOwnRadius = kOwnRadiusV;  // a radius for each metaball
  static constexpr bool kOwnColor = kOwnColorV;    // a colour for each metaball
  static_assert(kOwnRadius || !kBlended, "blended thresholds are drawn with a radius each");
  using Real = RealT;  // float; double where radii differ so much that floats cannot carry them
  static constexpr bool kCountWork = kCountWorkV;
  // Metaballs that a ray can be near at once before it falls back to the tile's list. A sheet whose
  // radius is 2.5 spacings has 20 over each point. Chosen with the shared memory of a
  // multiprocessor in mind: 5 blocks on 100 KB (3 on 64 KB, 10 on 228 KB) for uniform radii.
  static constexpr int kColumn = kBlended            ? (sizeof(Real) == 8 ? 14 : 20)
                                 : sizeof(Real) == 8 ? 20
                                 : kOwnRadius        ? 28
                                                     : 34;
};

struct TraceParams {
  Camera camera;  // the region's samples; eye and orthographic scale in local units
  MetaballArrays metaballs;
  const std::uint32_t* color = nullptr;     // PackColor; null: uniform_color
  const float* linear_from_srgb = nullptr;  // 256 values
  Vec3f uniform_color{};                    // linear
  const PixelBox16* box = nullptr;          // per metaball
  const std::uint32_t* entry = nullptr;     // metaballs of every tile, in depth order
  const EntryRange* range = nullptr;        // per tile
  const std::uint32_t* front = nullptr;     // per metaball: OrderedBits of the front distance
  int tiles_x = 0;
  // The camera in floats: axes, pixels to slopes (orthographic: to lengths).
  Vec3f right{}, down{};
  float inverse_fx = 1.0f, inverse_fy = 1.0f;
  double uniform_radius = 0.0;          // with radius_scale; 0 where each has its own
  double inverse_uniform_radius = 0.0;  // with radius_scale; 0 where each has its own
  double threshold = 0.7;               // over the density's amplitude; uniform mode
  DensityShape shape;
  double world_per_local = 1.0;
  FrameLight light;
  // Planes of the region, width x height of the camera; all but color may be null.
  Pixel* out_color = nullptr;
  float* out_depth = nullptr;
  Vec3f* out_normal = nullptr;
  std::int32_t* out_id = nullptr;
  double* out_hit = nullptr;  // local depth, -1 for none: what later kernels begin with
  TraceCounts* counts = nullptr;

  // Linear light.
  SHERD_HD Vec3f ColorOf(std::uint32_t i) const {
    return color ? UnpackColor(color[i], linear_from_srgb) : uniform_color;
  }
};

// A scene's shape as the type that a kernel was compiled for.
template <class Shape>
SHERD_HD Shape ShapeFor(const DensityShape& shape) {
  if constexpr (std::is_same_v<Shape, AnyShape>) {
    return AnyShape{shape};
  } else {
    return Shape{};
  }
}

template <class Real, bool kOwnRadius, bool kBlended>
struct ColumnEntry {
  Real b, across2, inverse_radius, threshold;
};
template <class Real>
struct ColumnEntry<Real, true, false> {
  Real b, across2, inverse_radius;
};
template <class Real>
struct ColumnEntry<Real, false, false> {
  Real b, across2;
};

// The thresholds of the staged entries, where they are blended.
template <class Real, bool kBlended>
struct StagedThresholds {};
template <class Real>
struct StagedThresholds<Real, true> {
  Real threshold[kChunk];
};

}  // namespace sherd::kernels
