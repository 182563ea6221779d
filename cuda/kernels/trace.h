// One screen tile: 64 rays against the tile's metaballs, front to back, then shading.
//
// The body is a program for a block of 64 threads, one ray each, written against an executor
// (block.h): Each(f) runs f for every thread and ends with a barrier. On the device a thread runs
// its own part; on the host a loop runs them all. What is declared outside Each is the same for the
// whole block.
//
// The tile's list is staged through shared memory 64 entries at a time, and not read by every ray
// through the read-only path: one thread fetches an entry (an index, then the metaball: two
// dependent reads of the device's memory), moves it to the tile's coordinates and finds the pixels
// it can touch once for all 64 rays, and the latency of those reads is paid once for 64 entries.
// Each ray then looks only at the entries whose pixel box covers it (bits in a word), and keeps of
// those it really passes what the march needs, its pass (density/shapes.h), in a column of shared
// memory.
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
#include "metaball/frame.h"
#include "metaball/shading.h"
#include "metaball/tile_march.h"

namespace sherd::kernels {

template <class Traits>
struct TraceProgram {
  using Real = typename Traits::Real;
  using V = Vec3<Real>;
  using Entry = ColumnEntry<Real, Traits::kOwnRadius>;
  static constexpr int kThreads = kTileRays;
  // Asked of the compiler, so that it neither spills for more blocks than shared memory lets in nor
  // takes more registers than these leave: 128 of 65536 in floats, 168 in doubles.
  static constexpr int kBlocksPerMultiprocessor = sizeof(Real) == 8 ? 6 : 8;
  static constexpr int kColumn = Traits::kColumn;
  using Shape = typename Traits::Shape;

  // The tile's place in the picture and the ray through its middle.
  struct TileRay {
    int x0, y0;
    RayD centre;
    float length;  // perspective: of the direction before it was made a unit vector
  };

  struct Shared {
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
    unsigned long long work[TraceCounts::kWorkCount];
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

  // The scene's shape as the type this kernel was compiled for.
  SHERD_HD Shape OwnShape() const {
    if constexpr (std::is_same_v<Shape, AnyShape>) {
      return AnyShape{p.shape};
    } else {
      return Shape{};
    }
  }

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

  // Direction and spread of the ray dx, dy pixels from the tile's centre ray. In floats the
  // difference of the two directions is found as a difference, so that it keeps its own accuracy
  // and no ray needs double precision (which many GPUs have little of):
  //   u / |u| - c / |c| = e / |u| - c m / (|u| |c| (|u| + |c|)),  e = u - c,  m = |u|^2 - |c|^2,
  // c and u being the two directions before they are made unit vectors.
  SHERD_HD void AimRay(const TileRay& tile, int thread, Ray& ray) const {
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
  SHERD_HD V OriginOf(const Ray& ray, const Place& place) const {
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
    if constexpr (kForShading) {
      Vec3f color = p.uniform_color;
      if constexpr (Traits::kOwnColor) {
        const std::uint32_t c8 = p.color[i];
        color = {p.linear_from_srgb[c8 & 0xff], p.linear_from_srgb[c8 >> 8 & 0xff],
                 p.linear_from_srgb[c8 >> 16 & 0xff]};
      }
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

  // ---- the march ------------------------------------------------------------------------------

  SHERD_HD static Real InverseOf(const Entry& e) {
    if constexpr (Traits::kOwnRadius) {
      return e.inverse_radius;
    } else {
      return Real(1);
    }
  }
  // Whether the ray at t has left the metaball's support.
  SHERD_HD static bool Passed(Real t, Real b, Real across2, Real inverse) {
    const Real s = t * inverse - b;
    return s > Real(0) && across2 + s * s >= Real(1);
  }

  // Moves the column to a base that lies `delta` farther and drops what the ray has passed. Returns
  // the smallest radius left (infinite for none).
  SHERD_HD static Real Trim(Shared& s, int thread, Ray& ray, Real delta) {
    int kept = 0;
    Real largest_inverse = Real(0);
    for (int k = 0; k < ray.count; ++k) {
      Entry e = s.column[k][thread];
      const Real inverse = InverseOf(e);
      e.b -= delta * inverse;
      if (Passed(ray.t, e.b, e.across2, inverse)) continue;
      s.column[kept++][thread] = e;
      largest_inverse = inverse > largest_inverse ? inverse : largest_inverse;
    }
    ray.count = kept;
    return Real(1) / largest_inverse;
  }

  // One metaball of the tile's list as the ray passes it; false where it misses.
  SHERD_HD bool ListPass(std::uint32_t e, const Place& place, const V& origin, const Ray& ray,
                         RayPass<Real>* pass, Real* inverse) const {
    const Sphere sphere = p.metaballs.sphere[p.entry[e]];
    *inverse = InverseRadius(sphere);
    *pass = PassOf<Real>(RelativeCenter(sphere, place) - origin, ray.direction, *inverse);
    return pass->across2 < Real(1);
  }

  // Trim for a ray in the wide state: skips the passed entries at the list's begin. Returns the
  // smallest radius among those not passed up to `list_end`.
  SHERD_HD Real TrimWide(const Place& place, const V& origin, std::uint32_t list_end,
                         Ray& ray) const {
    Real largest_inverse = Real(0);
    bool leading = true;
    for (std::uint32_t e = ray.wide_begin; e < list_end; ++e) {
      RayPass<Real> pass;
      Real inverse;
      const bool alive = ListPass(e, place, origin, ray, &pass, &inverse) &&
                         !Passed(ray.t, pass.b, pass.across2, inverse);
      if (alive) {
        leading = false;
        largest_inverse = inverse > largest_inverse ? inverse : largest_inverse;
      } else if (leading) {
        ray.wide_begin = e + 1;
      }
    }
    return Real(1) / largest_inverse;
  }

  // Adds what a ray in the wide state is near to a bound on [t, t + dt], which may count in
  // doubles.
  template <class Bound>
  SHERD_HD void AddWide(const Place& place, const V& origin, std::uint32_t list_end, const Ray& ray,
                        Real t, Real dt, Bound* bound) const {
    for (std::uint32_t e = ray.wide_begin; e < list_end; ++e) {
      RayPass<Real> pass;
      Real inverse;
      if (!ListPass(e, place, origin, ray, &pass, &inverse)) continue;
      bound->Add(t * inverse - pass.b, (t + dt) * inverse - pass.b, pass.across2);
    }
  }

  template <int N>
  SHERD_HD static Bernstein<Real, N> Rounded(const Bernstein<double, N>& sum) {
    Bernstein<Real, N> rounded;
    for (int k = 0; k <= N; ++k) rounded.c[k] = static_cast<Real>(sum.c[k]);
    return rounded;
  }

  // Marches from ray.t to t_stop (may be infinite: to the end of all supports).
  SHERD_HD void MarchTo(Shared& s, int thread, Real t_stop, Real smallest, const Place& place,
                        const V& origin, std::uint32_t list_end, Ray& ray) const {
    const Shape shape = OwnShape();
    const auto threshold = static_cast<Real>(p.threshold);
    MarchLimits<Real> limits;
    const auto step = [&](RayMarch<Real>* march) {
      const Real t = march->t, dt = march->dt;
      if constexpr (Traits::kCountWork) {
        ray.adds += static_cast<unsigned>(ray.count);
        if (ray.wide) ray.adds += list_end - ray.wide_begin;
      }
      ++ray.steps;
      // Floats lose too much of so many terms.
      if (ray.wide && list_end - ray.wide_begin > kFloatOverlap) {
        TightBound<double, Shape> bound(shape);
        AddWide(place, origin, list_end, ray, t, dt, &bound);
        return AdvanceUniform(Rounded(bound.Sum()), threshold, limits, march);
      }
      TightBound<Real, Shape> bound(shape);
      for (int k = 0; k < ray.count; ++k) {
        const Entry e = s.column[k][thread];
        if constexpr (Traits::kOwnRadius) {
          bound.Add(t * e.inverse_radius - e.b, (t + dt) * e.inverse_radius - e.b, e.across2);
        } else {
          const Real s0 = t - e.b;
          bound.Add(s0, s0 + dt, e.across2);
        }
      }
      if (ray.wide) AddWide(place, origin, list_end, ray, t, dt, &bound);
      return AdvanceUniform(bound.Sum(), threshold, limits, march);
    };
    while (ray.t < t_stop) {
      if (!(smallest < Real(INFINITY))) {  // near nothing: free up to what comes next
        ray.t = t_stop;
        ray.searching = t_stop < Real(INFINITY);
        return;
      }
      // The tolerance follows the smallest radius, so nothing that is smaller may be met on the
      // way, and what has been passed must not hold it down.
      const Real reach = ray.t + static_cast<Real>(kReachInRadii) * smallest;
      const Real end = reach < t_stop ? reach : t_stop;
      limits.tolerance = static_cast<Real>(kDepthTolerance) * smallest;
      limits.t_end = end;
      RayMarch<Real> march;
      march.t = ray.t;
      const Real first = static_cast<Real>(kFirstStepInRadii) * smallest;
      march.dt = first < end - ray.t ? first : end - ray.t;
      march.searching = true;
      march.hit = false;
      const bool resolved = RunMarch(step, kMaxSteps - ray.steps, &march, &ray.grazing);
      if (!resolved) {
        ray.unresolved = true;
        ray.searching = false;
        return;
      }
      if (march.hit) {
        ray.hit = place.base + static_cast<double>(march.t) * Unscale();
        ray.searching = false;
        return;
      }
      ray.t = end;
      if (ray.t < t_stop) {
        smallest =
            ray.wide ? TrimWide(place, origin, list_end, ray) : Trim(s, thread, ray, Real(0));
      }
    }
  }

  // Takes up the staged entries and marches to where the next ones begin. Returns whether the ray
  // still searches.
  SHERD_HD bool Advance(Shared& s, int thread, std::uint32_t cursor, int size, const Place& place,
                        Real delta, Ray& ray) const {
    if (!ray.searching) return false;
    const V origin = OriginOf(ray, place);
    const std::uint32_t list_end = cursor + static_cast<std::uint32_t>(size);
    const auto depth_of = [&](float front) {
      return static_cast<Real>((static_cast<double>(front) - place.base)) * Scale();
    };
    const Real t_next = depth_of(s.front[size]);
    ray.t -= delta;
    Real smallest = ray.wide ? TrimWide(place, origin, list_end, ray) : Trim(s, thread, ray, delta);
    std::uint64_t candidates = ray.wide ? 0 : Candidates(s, thread, size);
    while (true) {
      while (candidates != 0 && ray.count < kColumn) {
        const int k = LowestBit(candidates);
        candidates &= candidates - 1;
        Real inverse;
        const V to_center = StagedCenter(s, k, &inverse) - origin;
        const RayPass<Real> pass = PassOf<Real>(to_center, ray.direction, inverse);
        if constexpr (Traits::kCountWork) ++ray.tests;
        if (!(pass.across2 < Real(1)) || Passed(ray.t, pass.b, pass.across2, inverse)) continue;
        Entry entry;
        entry.b = pass.b;
        entry.across2 = pass.across2;
        if constexpr (Traits::kOwnRadius) entry.inverse_radius = inverse;
        s.column[ray.count++][thread] = entry;
        const Real radius = Real(1) / inverse;
        smallest = radius < smallest ? radius : smallest;
      }
      const bool full = candidates != 0;
      const Real t_stop = full ? depth_of(s.front[LowestBit(candidates)]) : t_next;
      MarchTo(s, thread, t_stop, smallest, place, origin, list_end, ray);
      if (!ray.searching) return false;
      if (!full) return true;
      smallest = Trim(s, thread, ray, Real(0));
      if (ray.count == kColumn) {  // all of them overlap here
        ray.wide = true;
        ray.count = 0;
        candidates = 0;
        smallest = TrimWide(place, origin, list_end, ray);
      }
    }
  }

  // ---- shading --------------------------------------------------------------------------------

  SHERD_HD void AddToSums(const Shared& s, int thread, int size, const Place& place,
                          Ray& ray) const {
    if (!(ray.hit >= 0.0)) return;
    const Real along = static_cast<Real>(ray.hit - place.base) * Scale();
    const V point = OriginOf(ray, place) + ray.direction * along;
    const Shape shape = OwnShape();
    std::uint64_t candidates = Candidates(s, thread, size);
    while (candidates != 0) {
      const int k = LowestBit(candidates);
      candidates &= candidates - 1;
      Real inverse;
      const V offset = point - StagedCenter(s, k, &inverse);
      const Vec4f shade = s.shade[k];
      const Vec3f offset_f = offset.template cast<float>();
      const auto inverse_f = static_cast<float>(inverse);
      const float u = Dot(offset_f * inverse_f, offset_f * inverse_f);
      if (!(u < 1.0f)) continue;
      ray.sums.Add(offset_f, shape.Value(u), shape.Slope(u), inverse_f * inverse_f,
                   {shade.x, shade.y, shade.z}, static_cast<std::int32_t>(BitsOf(shade.w)));
      if constexpr (Traits::kCountWork) ++ray.shade_adds;
    }
  }

  SHERD_HD void Write(int x, int y, const Ray& ray) const {
    if (x >= p.camera.width || y >= p.camera.height) return;
    const std::size_t at = static_cast<std::size_t>(y) * p.camera.width + x;
    Pixel pixel;
    Vec3f normal{};
    if (ray.hit >= 0.0) {
      const Vec3f to_viewer = -ray.direction.template cast<float>();
      normal = ray.sums.Normal(to_viewer);
      const Vec3f c = Shade(p.light, ray.sums.BlendedColor(), normal, to_viewer);
      pixel = {c.x, c.y, c.z, 1.0f};
    }
    p.out_color[at] = pixel;
    if (p.out_depth) {
      p.out_depth[at] = ray.hit >= 0.0 ? WorldDepth(ray.hit, p.world_per_local) : 0.0f;
    }
    if (p.out_normal) p.out_normal[at] = normal;
    if (p.out_id) p.out_id[at] = ray.hit >= 0.0 ? ray.sums.strongest_idx : -1;
  }

  // ---- the block's program --------------------------------------------------------------------

  template <class Block>
  SHERD_HD void operator()(Block& block) const {
    Shared& s = block.shared();
    const EntryRange list = p.range[block.index()];
    TileRay tile;
    tile.x0 = block.index() % p.tiles_x * kTileSize;
    tile.y0 = block.index() / p.tiles_x * kTileSize;

    // One thread finds the middle ray, in double precision, for all.
    block.Each([&](int thread, Ray&) {
      if (thread != 0) return;
      const double x = tile.x0 + 0.5 * kTileSize, y = tile.y0 + 0.5 * kTileSize;
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
      for (std::uint32_t& v : s.rare) v = 0;
      for (unsigned long long& v : s.work) v = 0;
    });
    tile.centre = {{s.centre[0], s.centre[1], s.centre[2]},
                   {s.centre[3], s.centre[4], s.centre[5]}};
    tile.length = s.centre_length;

    block.Each([&](int thread, Ray& ray) {
      AimRay(tile, thread, ray);
      ray.searching = tile.x0 + thread % kTileSize < p.camera.width &&
                      tile.y0 + thread / kTileSize < p.camera.height && list.begin < list.end;
      ray.wide_begin = list.begin;
    });

    std::uint32_t cursor = list.begin;
    int round = 0;
    bool working = list.begin < list.end;
    double base = working ? BaseOf(cursor) : 0.0;
    while (working) {
      const double previous = base;
      base = BaseOf(cursor);
      const Place place = PlaceAt(tile.centre, base);
      const Real delta = static_cast<Real>(base - previous) * Scale();
      block.Each(
          [&](int thread, Ray&) { Stage<false>(s, thread, cursor, list.end, round, place, tile); });
      const int size = static_cast<int>(s.first_far[round % 3]);
      working = block.EachAny([&](int thread, Ray& ray) {
        return Advance(s, thread, cursor, size, place, delta, ray);
      });
      cursor += static_cast<std::uint32_t>(size);
      ++round;
    }

    const bool any_hit = block.EachAny([&](int thread, Ray& ray) {
      (void)thread;
      const bool hit = ray.hit >= 0.0;
      if (hit) {
        const std::uint32_t bits = BitsOf(static_cast<float>(ray.hit));
        AtomicMin(&s.hit_min, bits);
        AtomicMax(&s.hit_max, bits);
        AtomicAdd(&s.rare[TraceCounts::kHits], 1);
        if (!(ray.hit > 0.0)) AtomicAdd(&s.rare[TraceCounts::kStartedInside], 1);
      }
      if (ray.grazing != 0) AtomicAdd(&s.rare[TraceCounts::kGrazing], ray.grazing);
      if (ray.unresolved) AtomicAdd(&s.rare[TraceCounts::kUnresolved], 1);
      if (ray.wide) AtomicAdd(&s.rare[TraceCounts::kWide], 1);
      if constexpr (Traits::kCountWork) {
        AtomicAdd(&s.work[TraceCounts::kTests], ray.tests);
        AtomicAdd(&s.work[TraceCounts::kAdds], ray.adds);
        AtomicAdd(&s.work[TraceCounts::kSteps], static_cast<unsigned long long>(ray.steps));
      }
      return hit;
    });

    if (any_hit) {
      const std::uint32_t end = cursor;
      for (cursor = list.begin; cursor < end; ++round) {
        const Place place = PlaceAt(tile.centre, BaseOf(cursor));
        const bool needed = block.EachAny([&](int thread, Ray&) {
          return Stage<true>(s, thread, cursor, end, round, place, tile);
        });
        const int size = static_cast<int>(s.first_far[round % 3]);
        if (needed) {
          block.Each([&](int thread, Ray& ray) { AddToSums(s, thread, size, place, ray); });
        }
        cursor += static_cast<std::uint32_t>(size);
      }
    }

    block.Each([&](int thread, Ray& ray) {
      Write(tile.x0 + thread % kTileSize, tile.y0 + thread / kTileSize, ray);
      if (thread < TraceCounts::kRareCount && s.rare[thread] != 0) {
        AtomicAdd(&p.counts->rare[thread], static_cast<unsigned long long>(s.rare[thread]));
      }
      if constexpr (Traits::kCountWork) {
        AtomicAdd(&p.counts->work[TraceCounts::kShadeAdds], ray.shade_adds);
        if (thread < TraceCounts::kShadeAdds) {
          AtomicAdd(&p.counts->work[thread], s.work[thread]);
        }
      }
    });
  }
};

}  // namespace sherd::kernels
