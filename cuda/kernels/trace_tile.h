// How one screen tile's rays and metaballs come into one frame: the state of a block that traces a
// tile (trace.h), the geometry of its rays, and the staging of its list.
//
// The tile's list is staged through shared memory 64 entries at a time, and not read by every ray
// through the read-only path: one thread fetches an entry (an index, then the metaball: two
// dependent reads of the device's memory), moves it to the tile's coordinates and finds the pixels
// it can touch once for all 64 rays, and the latency of those reads is paid once for 64 entries.
//
// Precision (the contract in docs/architecture.md): distances along the rays are floats counted
// from a base depth that moves with the list, coordinates are relative to a point of the tile's
// centre ray at that depth, found in double precision. An entry is taken up only within
// kReachInRadii of the base, so floats resolve 1e-4 of its radius wherever the camera stands. Where
// one radius is uniform, lengths are in radii.
#pragma once

#include <cstdint>
#include <type_traits>

#include "cuda/kernels/device_ops.h"
#include "cuda/kernels/trace_params.h"
#include "metaball/camera.h"
#include "metaball/first_crossing.h"
#include "metaball/shading.h"
#include "metaball/tile_march.h"

namespace sherd::kernels {

template <class Traits>
struct TraceTile {
  using Real = typename Traits::Real;
  using V = Vec3<Real>;
  using Entry = ColumnEntry<Real, Traits::kOwnRadius, Traits::kBlended>;
  static constexpr int kThreads = kTileRays;
  // Asked of the compiler, so that it neither spills for more blocks than shared memory lets in nor
  // takes more registers than these leave: 128 of 65536 in floats, 168 in doubles; 168 and
  // 255 where the density is not known to the compiler.
  static constexpr int kBlocksPerMultiprocessor =
      (sizeof(Real) == 8 ? 6 : 8) - (std::is_same_v<typename Traits::Shape, AnyShape> ? 2 : 0);
  static constexpr int kColumn = Traits::kColumn;
  using Shape = typename Traits::Shape;

  // The tile's place in the picture and the ray through its middle.
  struct TileRay {
    int x0, y0;
    RayD centre;
    float length;  // perspective: of the direction before it was made a unit vector
  };

  struct Shared : StagedThresholds<Real, Traits::kBlended> {
    double centre[6];     // origin and direction of the tile's middle ray
    float centre_length;  // TileRay's
    // Staged entries: centre relative to the tile's reference point, and 1 / radius where each has
    // its own. (In double precision: four arrays.)
    union {
      Vec4f staged[kChunk];
      double staged_double[sizeof(Real) == 8 ? 4 : 1][kChunk];
    };
    // Bit t of word w: the entry's pixel box covers thread 32 w + t.
    std::uint32_t coverage[2][kChunk];
    float front[kChunk + 1];         // distance from the eye; one more for what comes next
    std::uint32_t first_far[3];      // first staged entry out of reach, by turns
    std::uint32_t hit_min, hit_max;  // float bits of the nearest and farthest hit
    std::uint32_t rare[TraceCounts::kRareCount];
    unsigned long long work[Traits::kCountWork ? TraceCounts::kWorkCount : 1];
    union {
      Entry column[kColumn][kThreads];  // what each ray is near
      Vec4f shade[kChunk];              // later: linear colour and index of staged entries
    };
  };

  struct Ray {
    Vec3<Real> direction;
    Vec3<Real> spread;  // from the centre ray: change of direction, or orthographic offset
    Real t = Real(0);   // from the base; F < threshold before it
    double hit = -1.0;  // from the eye, local units
    int count = 0;      // entries in the column
    int steps = 0;
    std::uint32_t grazing = 0;
    bool searching = false;
    bool unresolved = false;
    // More metaballs overlap here than a column holds: sums run over the tile's list instead.
    bool wide = false;
    std::uint32_t wide_begin = 0;
    SurfaceSums sums;
    unsigned long long tests = 0, adds = 0, shade_adds = 0;
  };

  TraceParams p;

  SHERD_HD Shape OwnShape() const { return ShapeFor<Shape>(p.shape); }

  // ---- geometry -------------------------------------------------------------------------------

  SHERD_HD bool Orthographic() const { return p.camera.projection == Projection::kOrthographic; }

  // Lengths in the march per local unit: radii where all are the same.
  SHERD_HD Real Scale() const {
    if constexpr (Traits::kOwnRadius) {
      return Real(1);
    } else {
      return static_cast<Real>(p.inverse_uniform_radius);
    }
  }

  // Local units in a length of the march.
  SHERD_HD double Unscale() const {
    if constexpr (Traits::kOwnRadius) {
      return 1.0;
    } else {
      return p.uniform_radius;
    }
  }

  // Finds the tile's middle ray, in double precision, and readies the block's memory: one thread's
  // work for all.
  SHERD_HD void Begin(Shared& s, int index) const {
    const double x = index % p.tiles_x * kTileSize + 0.5 * kTileSize;
    const double y = index / p.tiles_x * kTileSize + 0.5 * kTileSize;
    const RayD centre = RayThrough(p.camera, x, y);
    s.centre[0] = centre.origin.x;
    s.centre[1] = centre.origin.y;
    s.centre[2] = centre.origin.z;
    s.centre[3] = centre.direction.x;
    s.centre[4] = centre.direction.y;
    s.centre[5] = centre.direction.z;
    const float slope_x = static_cast<float>((x - p.camera.cx) / p.camera.fx);
    const float slope_y = static_cast<float>((y - p.camera.cy) / p.camera.fy);
    s.centre_length = sqrtf(1.0f + slope_x * slope_x + slope_y * slope_y);
    s.first_far[0] = kChunk;
    s.hit_min = 0x7f800000u;  // infinity
    s.hit_max = 0;
  }

  // After Begin, for every thread.
  SHERD_HD TileRay TileOf(const Shared& s, int index) const {
    TileRay tile;
    tile.x0 = index % p.tiles_x * kTileSize;
    tile.y0 = index / p.tiles_x * kTileSize;
    tile.centre = {{s.centre[0], s.centre[1], s.centre[2]},
                   {s.centre[3], s.centre[4], s.centre[5]}};
    tile.length = s.centre_length;
    return tile;
  }

  // A hit of the tile, local depth: what lies before or behind all of them need not be looked at.
  SHERD_HD static void NoteHit(Shared& s, double hit) {
    const std::uint32_t bits = BitsOf(static_cast<float>(hit));
    AtomicMin(&s.hit_min, bits);
    AtomicMax(&s.hit_max, bits);
  }

  // Direction and spread of the ray dx, dy pixels from the tile's centre ray. In floats the
  // difference of the two directions is found as a difference, so that it keeps its own accuracy
  // and no ray needs double precision (which many GPUs have little of):
  //   u / |u| - c / |c| = e / |u| - c m / (|u| |c| (|u| + |c|)),  e = u - c,  m = |u|^2 - |c|^2,
  // c and u being the two directions before they are made unit vectors.
  template <class AnyRay>
  SHERD_HD void AimRay(const TileRay& tile, int thread, AnyRay& ray) const {
    const int px = thread % kTileSize, py = thread / kTileSize;
    if constexpr (sizeof(Real) == 4) {
      const float x = (static_cast<float>(px) + 0.5f - 0.5f * kTileSize) * p.inverse_fx;
      const float y = (static_cast<float>(py) + 0.5f - 0.5f * kTileSize) * p.inverse_fy;
      const Vec3f e = p.right * x + p.down * y;
      ray.direction = tile.centre.direction.template cast<float>();
      ray.spread = e;
      if (Orthographic()) return;
      const float c_length = tile.length;
      const Vec3f c = ray.direction * c_length;
      const float m = 2.0f * Dot(c, e) + Dot(e, e);
      const float u_length = sqrtf(c_length * c_length + m);
      ray.spread = e * (1.0f / u_length) - c * (m / (u_length * c_length * (u_length + c_length)));
      ray.direction += ray.spread;
    } else {
      const RayD own = RayThrough(p.camera, tile.x0 + px + 0.5, tile.y0 + py + 0.5);
      ray.direction = own.direction.template cast<Real>();
      ray.spread =
          (Orthographic() ? own.origin - tile.centre.origin : own.direction - tile.centre.direction)
              .template cast<Real>();
    }
  }

  // Where the tile's coordinates are counted from while the base is `base`.
  struct Place {
    double base = 0.0;     // depth, local units
    Vec3f reference{};     // a point near the centre ray at that depth
    Vec3<Real> residue{};  // centre ray at that depth minus reference, scaled
  };

  SHERD_HD Place PlaceAt(const RayD& centre, double base) const {
    Place place;
    place.base = base;
    const Vec3d point = centre.origin + base * centre.direction;
    place.reference = point.cast<float>();
    const Vec3d residue =
        (point - place.reference.template cast<double>()) * static_cast<double>(Scale());
    place.residue = residue.template cast<Real>();
    return place;
  }

  // The ray's point at the base, relative to the reference, scaled.
  template <class AnyRay>
  SHERD_HD V OriginOf(const AnyRay& ray, const Place& place) const {
    const Real reach = Orthographic() ? Real(1) : static_cast<Real>(place.base);
    return place.residue + ray.spread * (reach * Scale());
  }

  SHERD_HD float FrontOf(std::uint32_t e) const { return FloatFromOrdered(p.front[p.entry[e]]); }
  // The base for a chunk that begins with this entry: rays start at the eye, not behind it.
  SHERD_HD double BaseOf(std::uint32_t e) const {
    const float front = FrontOf(e);
    return front > 0.0f ? static_cast<double>(front) : 0.0;
  }

  // A metaball's centre relative to the reference, scaled, and 1 / radius (1 where uniform).
  SHERD_HD V RelativeCenter(const Sphere& c, const Place& place) const {
    return V{static_cast<Real>(c.x) - static_cast<Real>(place.reference.x),
             static_cast<Real>(c.y) - static_cast<Real>(place.reference.y),
             static_cast<Real>(c.z) - static_cast<Real>(place.reference.z)} *
           Scale();
  }
  SHERD_HD Real InverseRadius(const Sphere& c) const {
    if constexpr (Traits::kOwnRadius) {
      // radius x factor as the reference has it, where Real can hold the product.
      return Real(1) / (static_cast<Real>(c.radius) * static_cast<Real>(p.metaballs.radius_scale));
    } else {
      return Real(1);
    }
  }

  // ---- staging --------------------------------------------------------------------------------

  // Bits of the tile's 64 pixels that a box covers; rows 0..3 in the low word.
  SHERD_HD static std::uint64_t CoverageOf(const PixelBox16& box, int tile_x0, int tile_y0) {
    const int x0 = box.x0 > tile_x0 ? box.x0 - tile_x0 : 0;
    const int y0 = box.y0 > tile_y0 ? box.y0 - tile_y0 : 0;
    const int x1 = box.x1 < tile_x0 + kTileSize ? box.x1 - tile_x0 : kTileSize;
    const int y1 = box.y1 < tile_y0 + kTileSize ? box.y1 - tile_y0 : kTileSize;
    const std::uint64_t columns = (0xffu >> (kTileSize - (x1 - x0))) << x0;
    const std::uint64_t rows = (~std::uint64_t{0} >> (kTileSize * (kTileSize - (y1 - y0))))
                               << (kTileSize * y0);
    return columns * 0x0101010101010101ull & rows;
  }

  // Thread `thread` stages entry cursor + thread. Returns whether the entry may matter to a hit
  // between the depths of the nearest and farthest one (asked for shading only).
  template <bool kForShading>
  SHERD_HD bool Stage(Shared& s, int thread, std::uint32_t cursor, std::uint32_t end, int round,
                      const Place& place, const TileRay& tile) const {
    const int slot = round % 3;
    const std::uint32_t e = cursor + static_cast<std::uint32_t>(thread);
    if (thread == 0) {
      s.first_far[(round + 1) % 3] = kChunk;
      const std::uint32_t after = cursor + kChunk;
      s.front[kChunk] = after < end ? FrontOf(after) : INFINITY;
    }
    if (e >= end) {
      s.front[thread] = INFINITY;
      AtomicMin(&s.first_far[slot], static_cast<std::uint32_t>(thread));
      return false;
    }
    if constexpr (Traits::kCountWork) AtomicAdd(&s.work[TraceCounts::kStaged], 1ull);
    const std::uint32_t i = p.entry[e];
    const float front = FloatFromOrdered(p.front[i]);
    const Sphere sphere = p.metaballs.sphere[i];
    const float radius = p.metaballs.ScaledRadius(sphere);
    s.front[thread] = front;
    if (static_cast<double>(front) - place.base > static_cast<double>(kReachInRadii * radius)) {
      AtomicMin(&s.first_far[slot], static_cast<std::uint32_t>(thread));
    }
    const V c = RelativeCenter(sphere, place);
    const Real inverse = InverseRadius(sphere);
    if constexpr (sizeof(Real) == 4) {
      s.staged[thread] = {c.x, c.y, c.z, inverse};
    } else {
      s.staged_double[0][thread] = c.x;
      s.staged_double[1][thread] = c.y;
      s.staged_double[2][thread] = c.z;
      s.staged_double[3][thread] = inverse;
    }
    const std::uint64_t coverage = CoverageOf(p.box[i], tile.x0, tile.y0);
    s.coverage[0][thread] = static_cast<std::uint32_t>(coverage);
    s.coverage[1][thread] = static_cast<std::uint32_t>(coverage >> 32);
    if constexpr (Traits::kBlended) s.threshold[thread] = p.metaballs.template ThresholdOf<Real>(i);
    if constexpr (kForShading) {
      Vec3f color = p.uniform_color;
      if constexpr (Traits::kOwnColor) color = p.ColorOf(i);
      s.shade[thread] = {color.x, color.y, color.z, FloatOf(i)};
      // `front` is up to 4e-7 of the distance too small.
      const float back = front + 2.0f * radius + 4e-6f * (fabsf(front) + radius);
      return front <= FloatOf(s.hit_max) && back >= FloatOf(s.hit_min);
    }
    return false;
  }

  SHERD_HD static V StagedCenter(const Shared& s, int k, Real* inverse_radius) {
    if constexpr (sizeof(Real) == 4) {
      const Vec4f v = s.staged[k];
      *inverse_radius = v.w;
      return {v.x, v.y, v.z};
    } else {
      *inverse_radius = s.staged_double[3][k];
      return {s.staged_double[0][k], s.staged_double[1][k], s.staged_double[2][k]};
    }
  }

  // The staged entries (bit k) whose pixel box covers this thread's pixel.
  SHERD_HD static std::uint64_t Candidates(const Shared& s, int thread, int size) {
    const std::uint32_t* words = s.coverage[thread >> 5];
    const int bit = thread & 31;
    std::uint32_t low = 0, high = 0;
    for (int k = 0; k < 32; ++k) low |= (words[k] >> bit & 1u) << k;
    for (int k = 0; k < 32; ++k) high |= (words[k + 32] >> bit & 1u) << k;
    const std::uint64_t all = static_cast<std::uint64_t>(high) << 32 | low;
    return size < 64 ? all & ((std::uint64_t{1} << size) - 1) : all;
  }
};

}  // namespace sherd::kernels
