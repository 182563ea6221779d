// The planes beyond colour, depth, normal and id: once more over the tile's list, for each hit the
// metaballs whose support holds it. Launched only for planes that are wanted, one launch for the
// field's planes and one for each channel and each set of texture coordinates; what is summed
// stands in metaball/appearance/gather_sums.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/kernels/device_ops.h"
#include "cuda/kernels/trace_params.h"
#include "cuda/kernels/trace_tile.h"
#include "metaball/appearance/gather_sums.h"
#include "metaball/bits.h"

namespace sherd::kernels {

// The tile's machinery without a column of its own: nothing is marched here.
template <class RealT>
struct GatherTraits {
  using Shape = AnyShape;
  using Real = RealT;
  static constexpr bool kBlended = false, kOwnRadius = true, kOwnColor = false, kCountWork = false;
  static constexpr int kColumn = 1;
};

// ---- what is summed: one type a kernel ----------------------------------------------------------

struct GatherField {
  static constexpr bool kNeedsStrongest = false;
  struct Sums : FieldSums {};
  float* weight = nullptr;  // any may be null
  float* intensity = nullptr;
  Vec3f* influence = nullptr;
  float amplitude = 1.0f;  // of the density

  SHERD_HD void Add(std::uint32_t, const Vec3f& offset, float, float f, Sums* sums) const {
    sums->FieldSums::Add(offset, f);
  }
  SHERD_HD void Write(std::size_t at, const Sums& sums) const {
    if (weight) weight[at] = sums.Weight(amplitude);
    if (intensity) intensity[at] = sums.Intensity(amplitude);
    if (influence) influence[at] = sums.Influence();
  }
};

struct GatherChannel {
  static constexpr bool kNeedsStrongest = false;
  struct Sums : ChannelSums {};
  ChannelView channel;
  float* plane = nullptr;  // channel.components a pixel

  SHERD_HD void Add(std::uint32_t metaball, const Vec3f&, float, float f, Sums* sums) const {
    sums->ChannelSums::Add(channel.Get(metaball), f);
  }
  SHERD_HD void Write(std::size_t at, const Sums& sums) const {
    for (int k = 0; k < channel.components; ++k) plane[at * channel.components + k] = sums.Mean(k);
  }
};

struct GatherUv {
  static constexpr bool kNeedsStrongest = true;
  struct Sums : UvSums {};
  UvChannel channel;
  SurfaceUv* plane = nullptr;

  SHERD_HD void Begin(std::uint32_t metaball, const Vec3f& offset, float inverse_radius,
                      Sums* sums) const {
    sums->base = SampleUv(channel, metaball, offset, inverse_radius);
  }
  SHERD_HD void Add(std::uint32_t metaball, const Vec3f& offset, float inverse_radius, float f,
                    Sums* sums) const {
    sums->UvSums::Add(channel, SampleUv(channel, metaball, offset, inverse_radius), f);
  }
  SHERD_HD void Write(std::size_t at, const Sums& sums) const { plane[at] = sums.Mean(); }
};

// ---- one screen tile ----------------------------------------------------------------------------

template <class RealT, class GatherT>
struct GatherProgram : TraceTile<GatherTraits<RealT>> {
  using Gather = GatherT;
  using Tile = TraceTile<GatherTraits<RealT>>;
  using Tile::BaseOf;
  using Tile::Candidates;
  using Tile::kThreads;
  using Tile::OriginOf;
  using Tile::OwnShape;
  using Tile::p;
  using Tile::PlaceAt;
  using Tile::StagedCenter;
  using typename Tile::Place;
  using typename Tile::Real;
  using typename Tile::Shared;
  using typename Tile::TileRay;
  using typename Tile::V;

  struct Ray {
    Vec3<Real> direction, spread;  // as TraceTile's
    double hit = -1.0;
    // The metaball whose sphere the surface is (gated), or whose coordinates the others are taken
    // relative to; none of the list's: none.
    std::uint32_t chosen = 0xffffffffu;
    float most = -INFINITY;
    typename Gather::Sums sums;
  };

  const double* hit = nullptr;  // the trace's out_hit
  bool gated = false;           // one metaball alone forms the surface
  Gather gather;

  SHERD_HD GatherProgram(const TraceParams& params, bool is_gated, const Gather& what)
      : Tile{params}, hit(params.out_hit), gated(is_gated), gather(what) {}

  // Calls visit(metaball, offset, 1 / radius, f) for the staged entries that hold the ray's hit.
  template <class Visit>
  SHERD_HD void ForEachAtHit(const Shared& s, int thread, int size, const Place& place,
                             const Ray& ray, const Visit& visit) const {
    if (!(ray.hit >= 0.0)) return;
    const V point = OriginOf(ray, place) + ray.direction * static_cast<Real>(ray.hit - place.base);
    std::uint64_t candidates = Candidates(s, thread, size);
    while (candidates != 0) {
      const int k = LowestBit(candidates);
      candidates &= candidates - 1;
      Real inverse;
      const V exact = point - StagedCenter(s, k, &inverse);
      const Vec3f offset = exact.template cast<float>();
      const auto inverse_radius = static_cast<float>(inverse);
      const Vec3f scaled = offset * inverse_radius;
      const float u = Dot(scaled, scaled);
      if (!(u < 1.0f)) continue;
      visit(BitsOf(s.shade[k].w), offset, inverse_radius, Max(OwnShape().Value(u), 0.0f));
    }
  }

  // Walks the list as far as the tile's farthest hit.
  template <class Block, class Visit>
  SHERD_HD void Walk(Block& block, const TileRay& tile, int* round, const Visit& visit) const {
    Shared& s = block.shared();
    const EntryRange list = p.range[block.index()];
    std::uint32_t cursor = list.begin;
    while (cursor < list.end && Tile::FrontOf(cursor) <= FloatOf(s.hit_max)) {
      const Place place = PlaceAt(tile.centre, BaseOf(cursor));
      const bool needed = block.EachAny([&](int thread, Ray&) {
        return Tile::template Stage<true>(s, thread, cursor, list.end, *round, place, tile);
      });
      const int size = static_cast<int>(s.first_far[*round % 3]);
      if (needed) {
        block.Each([&](int thread, Ray& ray) { visit(s, thread, size, place, ray); });
      }
      cursor += static_cast<std::uint32_t>(size);
      ++*round;
    }
  }

  template <class Block>
  SHERD_HD void operator()(Block& block) const {
    Shared& s = block.shared();
    block.Each([&](int thread, Ray&) {
      if (thread == 0) Tile::Begin(s, block.index());
    });
    const TileRay tile = Tile::TileOf(s, block.index());
    const auto pixel_of = [&](int thread, std::size_t* at) {
      const int x = tile.x0 + thread % kTileSize, y = tile.y0 + thread / kTileSize;
      *at = static_cast<std::size_t>(y) * p.camera.width + x;
      return x < p.camera.width && y < p.camera.height;
    };
    const bool any_hit = block.EachAny([&](int thread, Ray& ray) {
      Tile::AimRay(tile, thread, ray);
      std::size_t at = 0;
      ray.hit = pixel_of(thread, &at) ? hit[at] : -1.0;
      if (!(ray.hit >= 0.0)) return false;
      Tile::NoteHit(s, ray.hit);
      return true;
    });
    int round = 0;
    const bool choose = gated || Gather::kNeedsStrongest;
    if (any_hit && choose) {
      Walk(block, tile, &round,
           [&](const Shared& staged, int thread, int size, const Place& place, Ray& ray) {
             ForEachAtHit(staged, thread, size, place, ray,
                          [&](std::uint32_t i, const Vec3f& offset, float inverse, float f) {
                            // As far above its threshold as any, or as strong.
                            const float rank = gated ? f - p.metaballs.ThresholdOf(i) : f;
                            if (!(rank > ray.most) || (!gated && !(f > 0.0f))) return;
                            ray.most = rank;
                            ray.chosen = i;
                            if constexpr (Gather::kNeedsStrongest) {
                              gather.Begin(i, offset, inverse, &ray.sums);
                            }
                          });
           });
    }
    if (any_hit) {
      Walk(block, tile, &round,
           [&](const Shared& staged, int thread, int size, const Place& place, Ray& ray) {
             ForEachAtHit(staged, thread, size, place, ray,
                          [&](std::uint32_t i, const Vec3f& offset, float inverse, float f) {
                            if (f > 0.0f && (!gated || i == ray.chosen)) {
                              gather.Add(i, offset, inverse, f, &ray.sums);
                            }
                          });
           });
    }
    block.Each([&](int thread, Ray& ray) {
      std::size_t at = 0;
      if (pixel_of(thread, &at)) gather.Write(at, ray.sums);
    });
  }
};

}  // namespace sherd::kernels
