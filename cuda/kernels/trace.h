// One screen tile: 64 rays against the tile's metaballs, front to back, then shading.
//
// The body is a program for a block of 64 threads, one ray each, written against an executor
// (block.h): Each(f) runs f for every thread and ends with a barrier. On the device a thread runs
// its own part; on the host a loop runs them all. What is declared outside Each is the same for the
// whole block. How a ray and the tile's entries come into one frame stands in trace_tile.h.
//
// Each ray looks only at the staged entries whose pixel box covers it (bits in a word), and keeps
// of those it really passes what the march needs, its pass (density/shapes.h), in a column of
// shared memory.
#pragma once

#include <cstdint>
#include <type_traits>

#include "cuda/kernels/device_ops.h"
#include "cuda/kernels/trace_params.h"
#include "cuda/kernels/trace_tile.h"
#include "metaball/bits.h"
#include "metaball/camera.h"
#include "metaball/first_crossing.h"
#include "metaball/frame.h"
#include "metaball/shading.h"
#include "metaball/tile_march.h"

namespace sherd::kernels {

template <class Traits>
struct TraceProgram : TraceTile<Traits> {
  using Tile = TraceTile<Traits>;
  using Tile::BaseOf;
  using Tile::Candidates;
  using Tile::InverseRadius;
  using Tile::kColumn;
  using Tile::OriginOf;
  using Tile::OwnShape;
  using Tile::p;
  using Tile::PlaceAt;
  using Tile::RelativeCenter;
  using Tile::Scale;
  using Tile::StagedCenter;
  using Tile::Unscale;
  using typename Tile::Entry;
  using typename Tile::Place;
  using typename Tile::Ray;
  using typename Tile::Real;
  using typename Tile::Shape;
  using typename Tile::Shared;
  using typename Tile::TileRay;
  using typename Tile::V;

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
      const Real s0 = t * inverse - pass.b, s1 = (t + dt) * inverse - pass.b;
      if constexpr (Traits::kBlended) {
        bound->Add(s0, s1, pass.across2, p.metaballs.template ThresholdOf<Real>(p.entry[e]));
      } else {
        bound->Add(s0, s1, pass.across2);
      }
    }
  }

  // The least threshold of what a ray is near, or lower.
  SHERD_HD Real LowestThreshold(const Shared& s, int thread, std::uint32_t list_end,
                                const Ray& ray) const {
    Real lowest = Real(INFINITY);
    if constexpr (Traits::kBlended) {
      for (int k = 0; k < ray.count; ++k) lowest = Min(lowest, s.column[k][thread].threshold);
      if (ray.wide) {
        for (std::uint32_t e = ray.wide_begin; e < list_end; ++e) {
          lowest = Min(lowest, p.metaballs.template ThresholdOf<Real>(p.entry[e]));
        }
      }
    }
    return lowest;
  }

  template <class T, int N>
  SHERD_HD static Bernstein<Real, N> Rounded(const Bernstein<T, N>& sum) {
    Bernstein<Real, N> rounded;
    for (int k = 0; k <= N; ++k) rounded.c[k] = static_cast<Real>(sum.c[k]);
    return rounded;
  }

  // The bound that the scene's thresholds ask for, and the march's step on it.
  template <class T>
  using BoundOf =
      std::conditional_t<Traits::kBlended, BlendedBound<T, Shape>, TightBound<T, Shape>>;
  template <class Bound>
  SHERD_HD static bool StepOn(const Bound& bound, Real threshold, const MarchLimits<Real>& limits,
                              RayMarch<Real>* march) {
    if constexpr (Traits::kBlended) {
      return AdvanceBlended(Rounded(bound.Excess()), Rounded(bound.Weight()), threshold, limits,
                            march);
    } else {
      return AdvanceUniform(Rounded(bound.Sum()), threshold, limits, march);
    }
  }

  // Marches from ray.t to t_stop (may be infinite: to the end of all supports).
  SHERD_HD void MarchTo(Shared& s, int thread, Real t_stop, Real smallest, const Place& place,
                        const V& origin, std::uint32_t list_end, Ray& ray) const {
    const Shape shape = OwnShape();
    auto threshold = static_cast<Real>(p.threshold);  // of all, or the least one
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
        BoundOf<double> bound(shape);
        AddWide(place, origin, list_end, ray, t, dt, &bound);
        return StepOn(bound, threshold, limits, march);
      }
      BoundOf<Real> bound(shape);
      for (int k = 0; k < ray.count; ++k) {
        const Entry e = s.column[k][thread];
        if constexpr (Traits::kBlended) {
          bound.Add(t * e.inverse_radius - e.b, (t + dt) * e.inverse_radius - e.b, e.across2,
                    e.threshold);
        } else if constexpr (Traits::kOwnRadius) {
          bound.Add(t * e.inverse_radius - e.b, (t + dt) * e.inverse_radius - e.b, e.across2);
        } else {
          const Real s0 = t - e.b;
          bound.Add(s0, s0 + dt, e.across2);
        }
      }
      if (ray.wide) AddWide(place, origin, list_end, ray, t, dt, &bound);
      return StepOn(bound, threshold, limits, march);
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
      if constexpr (Traits::kBlended) threshold = LowestThreshold(s, thread, list_end, ray);
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
        if constexpr (Traits::kBlended) entry.threshold = s.threshold[k];
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
      const float slope = shape.Slope(u);
      ray.sums.Add(offset_f, shape.Value(u), slope, inverse_f * inverse_f,
                   {shade.x, shade.y, shade.z}, static_cast<std::int32_t>(BitsOf(shade.w)));
      if constexpr (Traits::kBlended) {
        ray.sums.AddThreshold(offset_f, slope, inverse_f * inverse_f,
                              static_cast<float>(s.threshold[k]));
      }
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
      normal = Traits::kBlended ? ray.sums.BlendedNormal(to_viewer) : ray.sums.Normal(to_viewer);
      const Vec3f c = Shade(p.light, ray.sums.BlendedColor(), normal, to_viewer);
      pixel = {c.x, c.y, c.z, 1.0f};
    }
    p.out_color[at] = pixel;
    if (p.out_depth) {
      p.out_depth[at] = ray.hit >= 0.0 ? WorldDepth(ray.hit, p.world_per_local) : 0.0f;
    }
    if (p.out_normal) p.out_normal[at] = normal;
    if (p.out_id) p.out_id[at] = ray.hit >= 0.0 ? ray.sums.strongest_idx : -1;
    if (p.out_hit) p.out_hit[at] = ray.hit;
  }

  // ---- the block's program --------------------------------------------------------------------

  template <class Block>
  SHERD_HD void operator()(Block& block) const {
    Shared& s = block.shared();
    const EntryRange list = p.range[block.index()];
    block.Each([&](int thread, Ray&) {
      if (thread != 0) return;
      Tile::Begin(s, block.index());
      for (std::uint32_t& v : s.rare) v = 0;
      for (unsigned long long& v : s.work) v = 0;
    });
    const TileRay tile = Tile::TileOf(s, block.index());

    block.Each([&](int thread, Ray& ray) {
      Tile::AimRay(tile, thread, ray);
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
      block.Each([&](int thread, Ray&) {
        Tile::template Stage<false>(s, thread, cursor, list.end, round, place, tile);
      });
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
        Tile::NoteHit(s, ray.hit);
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
          return Tile::template Stage<true>(s, thread, cursor, end, round, place, tile);
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
