// Packets of shadow rays: the march of tile_march.h with a ray in every lane, which ends as soon as
// any point of the ray is certain to lie inside the surface. Included once for each instruction set
// by the occlusion_packets*.cc.
//
// The rays of one call form a beam, which is walked through the tree once; each packet of them is a
// narrower beam through what was found.

#if defined(SHERD_OCCLUSION_PACKETS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SHERD_OCCLUSION_PACKETS_INL_H
#undef SHERD_OCCLUSION_PACKETS_INL_H
#else
#define SHERD_OCCLUSION_PACKETS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "metaball/appearance/occlusion_job.h"
#include "metaball/bits.h"
#include "metaball/packet_window-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

#define SHERD_FORMULA SHERD_PACKET_INLINE HWY_MAYBE_UNUSED
#include "metaball/appearance/beam-inl.h"
#undef SHERD_FORMULA

// Metaballs that a packet takes in at once, wherever on its way they are.
inline constexpr std::size_t kAllAtOnce = 48;

// Which of sixteen things pass a test (bit 0: the first), however wide the vectors are; test(k)
// tells of those from position k on.
template <class Test>
SHERD_PACKET_INLINE std::uint32_t MaskOfSixteen(const Test& test) {
  using D = Lanes<float>::D;
  std::uint32_t mask = 0;
  for (std::size_t k = 0; k < 16; k += hn::Lanes(D())) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(D(), test(k).m, bits);
    mask |= (bits[0] | static_cast<std::uint32_t>(bits[1]) << 8) << k;
  }
  return mask;
}

// Metaballs that a beam may meet.
struct BeamFinds {
  std::vector<float> x, y, z, radius;  // padded to full sixteens
  std::vector<std::uint32_t> idx;      // by the cloud

  SHERD_PACKET_INLINE void Clear() {
    for (auto* v : {&x, &y, &z, &radius}) v->clear();
    idx.clear();
  }
  SHERD_PACKET_INLINE void Pad() {
    const std::size_t padded = (idx.size() + 15) / 16 * 16;
    for (auto* v : {&x, &y, &z}) v->resize(padded, 1e30f);
    radius.resize(padded, 0.0f);
  }
};

class BeamCollector {
  using F = Lanes<float>;

 public:
  SHERD_PACKET_INLINE BeamCollector(const SupportTreeView& tree, const Beam& beam, BeamFinds* finds)
      : tree_(tree), beam_(beam), finds_(*finds) {}
  SHERD_PACKET_INLINE std::uint32_t Boxes(const SupportTreeLevelView& level,
                                          std::uint32_t first) const {
    return MaskOfSixteen([&](std::size_t b) HWY_ATTR {
      const std::size_t k = first + b;
      return BeamMeetsBox(beam_, F::Load(&level.min_x[k]), F::Load(&level.min_y[k]),
                          F::Load(&level.min_z[k]), F::Load(&level.max_x[k]),
                          F::Load(&level.max_y[k]), F::Load(&level.max_z[k]));
    });
  }
  SHERD_PACKET_INLINE void Metaballs(std::uint32_t first) const {
    std::uint32_t met = MaskOfSixteen([&](std::size_t b) HWY_ATTR {
      const std::size_t k = first + b;
      F front, exit;
      return BeamMeetsSupport(beam_, F::Load(&tree_.x[k]), F::Load(&tree_.y[k]),
                              F::Load(&tree_.z[k]), F::Load(&tree_.radius[k]), &front, &exit);
    });
    for (; met != 0; met &= met - 1) {
      const std::size_t k = first + static_cast<std::size_t>(std::countr_zero(met));
      finds_.x.push_back(tree_.x[k]);
      finds_.y.push_back(tree_.y[k]);
      finds_.z.push_back(tree_.z[k]);
      finds_.radius.push_back(tree_.radius[k]);
      finds_.idx.push_back(tree_.IndexOf(k));
    }
  }

 private:
  const SupportTreeView& tree_;
  const Beam& beam_;
  BeamFinds& finds_;
};

// Rays that are cast together at most.
inline constexpr int kBundle = 64;
// A ray's parameter is shifted where the cosine of its angle to the axis is above this.
inline constexpr double kAcross = 0.5;

// Rays as differences from an axis through their middle: o_i + t d_i is at
//   axis(t) + offset_i + t turn_i.
// Each ray's parameter is shifted so that it is 0 where the ray passes the plane through the axis's
// origin and across it (kAcross).
template <int kMost>
struct RayBundle {
  Vec3d origin, direction;
  double spread = 0, begin = INFINITY, end = -INFINITY;
  bool parallel = true;  // no ray turns
  int count = 0;
  double offset_x[kMost], offset_y[kMost], offset_z[kMost];
  double turn_x[kMost], turn_y[kMost], turn_z[kMost];
  double ray_begin[kMost], ray_end[kMost];

  SHERD_PACKET_INLINE void Aim(const SupportTreeView& tree, const OcclusionRay* rays, int n) {
    count = n;
    Vec3d lo = rays[0].origin, hi = lo, sum{};
    for (int i = 0; i < n; ++i) {
      const Vec3d& p = rays[i].origin;
      lo = {std::min(lo.x, p.x), std::min(lo.y, p.y), std::min(lo.z, p.z)};
      hi = {std::max(hi.x, p.x), std::max(hi.y, p.y), std::max(hi.z, p.z)};
      sum += rays[i].direction;
    }
    origin = (lo + hi) * 0.5;
    direction = rays[0].direction;
    for (int i = 0; i < n; ++i) parallel = parallel && rays[i].direction == direction;
    if (!parallel) direction = Normalized(sum, direction);
    const double farthest = Length(origin - tree.middle) + tree.reach + 0.5 * Length(hi - lo);
    for (int i = 0; i < n; ++i) {
      const OcclusionRay& ray = rays[i];
      const Vec3d to_origin = origin - ray.origin;
      const double cosine = parallel ? 1.0 : Dot(ray.direction, direction);
      const double shift = cosine > kAcross ? Dot(to_origin, direction) / cosine : 0.0;
      const Vec3d offset = ray.direction * shift - to_origin;
      const Vec3d turn = ray.direction - direction;
      offset_x[i] = offset.x;
      offset_y[i] = offset.y;
      offset_z[i] = offset.z;
      turn_x[i] = turn.x;
      turn_y[i] = turn.y;
      turn_z[i] = turn.z;
      ray_begin[i] = ray.begin - shift;
      ray_end[i] = std::min(ray.end - shift, farthest + std::abs(shift));
      begin = std::min(begin, ray_begin[i]);
      end = std::max(end, ray_end[i]);
    }
    double spread2 = 0;
    for (int i = 0; i < n; ++i) {
      const Vec3d first = Offset(i, begin), last = Offset(i, end);
      spread2 = std::max({spread2, Dot(first, first), Dot(last, last)});
    }
    spread = std::sqrt(spread2);
  }
  SHERD_PACKET_INLINE Vec3d Offset(int i, double t) const {
    return {offset_x[i] + t * turn_x[i], offset_y[i] + t * turn_y[i], offset_z[i] + t * turn_z[i]};
  }
  Beam BeamIn(const SupportTreeView& tree) const {
    return BeamThrough(tree, origin, direction, spread, begin, end);
  }
};

template <ThresholdMode kMode, class Real, class Shape>
class OcclusionPackets {
  using L = Lanes<Real>;
  using M = LaneMask<Real>;
  using D = typename L::D;
  using F = Lanes<float>;
  // One radius for all is rare enough among what casts shadows to pay for itself.
  using Window = PacketWindow<kMode, Real, true, Shape>;

 public:
  struct Candidate {
    float front, exit;
    std::uint32_t idx;
  };
  // Kept between calls.
  struct Memory {
    BeamFinds finds;
    std::vector<Candidate> candidates;
    typename Window::Memory window;
  };

  SHERD_PACKET_INLINE OcclusionPackets(const OcclusionJob& job, const Shape& shape, Memory* memory,
                                       RayCounts* counts)
      : job_(job), memory_(*memory), counts_(*counts), window_(job.list, shape, &memory->window) {}

  // count <= kBundle.
  SHERD_PACKET_INLINE void Cast(const OcclusionRay* rays, int count, std::uint8_t* occluded) {
    BeamFinds& finds = memory_.finds;
    finds.Clear();
    RayBundle<kBundle> bundle;
    bundle.Aim(job_.tree, rays, count);
    const Beam beam = bundle.BeamIn(job_.tree);
    BeamCollector collector(job_.tree, beam, &finds);
    WalkTree(job_.tree, &collector);
    finds.Pad();
    const int lanes = L::Count();
    for (int first = 0; first < count; first += lanes) {
      const int n = std::min(lanes, count - first);
      if (finds.idx.empty()) {
        std::fill(occluded + first, occluded + first + n, std::uint8_t{0});
      } else {
        CastPacket(rays + first, n, occluded + first);
      }
    }
  }

 private:
  // What of the finds the packet's own beam may meet.
  SHERD_PACKET_INLINE void Narrow(const Beam& beam) {
    const BeamFinds& finds = memory_.finds;
    std::vector<Candidate>& candidates = memory_.candidates;
    candidates.clear();
    HWY_ALIGN float front[16], exit[16];
    for (std::size_t k = 0; k < finds.x.size(); k += 16) {
      std::uint32_t met = MaskOfSixteen([&](std::size_t b) HWY_ATTR {
        F near, far;
        const LaneMask<float> in =
            BeamMeetsSupport(beam, F::Load(&finds.x[k + b]), F::Load(&finds.y[k + b]),
                             F::Load(&finds.z[k + b]), F::Load(&finds.radius[k + b]), &near, &far);
        near.Store(front + b);
        far.Store(exit + b);
        return in;
      });
      for (; met != 0; met &= met - 1) {
        const int b = std::countr_zero(met);
        candidates.push_back({front[b], exit[b], finds.idx[k + static_cast<std::size_t>(b)]});
      }
    }
  }

  // Counts the coordinates of a window from the axis's point at `start`.
  SHERD_PACKET_INLINE Anchor<Real> PlaceAnchor(const RayBundle<kMaxLanes>& bundle, double start) {
    for (int i = 0; i < bundle.count; ++i) {
      const Vec3d o = bundle.Offset(i, start);
      rays_.ox[i] = static_cast<Real>(o.x);
      rays_.oy[i] = static_cast<Real>(o.y);
      rays_.oz[i] = static_cast<Real>(o.z);
      begin_[i] = static_cast<Real>(std::max(0.0, bundle.ray_begin[i] - start));
      end_[i] = static_cast<Real>(bundle.ray_end[i] - start);
    }
    return Anchor<Real>(bundle.origin + bundle.direction * start);
  }

  SHERD_PACKET_INLINE void CastPacket(const OcclusionRay* rays, int count, std::uint8_t* occluded) {
    RayBundle<kMaxLanes> bundle;
    bundle.Aim(job_.tree, rays, count);
    Narrow(bundle.BeamIn(job_.tree));
    const int lanes = L::Count();
    for (int i = 0; i < lanes; ++i) {
      const OcclusionRay& ray = rays[std::min(i, count - 1)];
      rays_.dx[i] = static_cast<Real>(ray.direction.x);
      rays_.dy[i] = static_cast<Real>(ray.direction.y);
      rays_.dz[i] = static_cast<Real>(ray.direction.z);
      rays_.ox[i] = rays_.oy[i] = rays_.oz[i] = Real(0);
      begin_[i] = end_[i] = Real(0);  // lanes without a ray have no way to go
    }
    const M hit = Search(bundle);
    HWY_ALIGN Real is_hit[kMaxLanes];
    Where(hit, L(1), L(0)).Store(is_hit);
    for (int i = 0; i < count; ++i) occluded[i] = is_hit[i] != Real(0);
  }

  // How far a window reaches at first: about as far as a metaball does.
  SHERD_PACKET_INLINE double FirstSlab() const {
    double sum = 0;
    for (const Candidate& c : memory_.candidates) sum += c.exit - c.front;
    return 0.5 * sum / static_cast<double>(memory_.candidates.size());
  }

  // Which of the packet's rays meet the surface.
  SHERD_PACKET_INLINE M Search(const RayBundle<kMaxLanes>& bundle) {
    std::vector<Candidate>& candidates = memory_.candidates;  // those not yet reached
    M hit = L(0) > L(0);
    window_.Clear();
    double start = bundle.begin;
    double slab = candidates.empty() ? 0.0 : FirstSlab();
    bool more = !candidates.empty();
    while (more) {
      const Anchor<Real> anchor = PlaceAnchor(bundle, start);
      const L end_of_ray = L::Load(end_);
      const M searching = Both(Not(hit), end_of_ray > L(0));
      if (searching.None()) break;
      L enters;
      window_.MoveTo(anchor, start, rays_, searching, &enters);
      window_.Reserve(static_cast<int>(candidates.size()));
      // What begins before the window's end; it then reaches up to the first that does not.
      const double wanted = candidates.size() <= kAllAtOnce ? INFINITY : start + slab;
      double end = bundle.end;
      std::size_t taken = 0, kept = 0;
      for (const Candidate& candidate : candidates) {
        if (candidate.front <= wanted) {
          window_.Add(
              window_.EntryAt(anchor, start, candidate.idx, candidate.front, candidate.exit), rays_,
              searching, &enters);
          ++taken;
        } else {
          end = std::min(end, static_cast<double>(candidate.front));
          candidates[kept++] = candidate;
        }
      }
      candidates.resize(kept);
      more = kept > 0;
      if (taken < static_cast<std::size_t>(PacketWindowOf(L::Count()))) {
        slab *= 2;
      } else if (taken > 2 * static_cast<std::size_t>(PacketWindowOf(L::Count()))) {
        slab /= 2;
      }
      if (window_.size() > 0) {
        const auto room = static_cast<Real>(
            std::min(static_cast<double>(window_.extent().last_exit), end) - start);
        const L t_end = Min(end_of_ray, L(room));
        typename Window::Way way = window_.Begin(L::Load(begin_), enters, t_end, room, searching);
        while (!way.march.searching.None()) {
          window_.template Step<MarchGoal::kAny, false>(&way, &counts_);
        }
        hit = Either(hit, way.march.hit);
      }
      start = end;
    }
    return hit;
  }

  const OcclusionJob& job_;
  Memory& memory_;
  RayCounts& counts_;
  Window window_;
  PacketRays<Real> rays_;
  HWY_ALIGN Real begin_[kMaxLanes], end_[kMaxLanes];  // of each ray, from the window's start
};

template <ThresholdMode kMode, class Real, class Shape>
SHERD_PACKET_INLINE void CastPackets(const OcclusionJob& job, const Shape& shape,
                                     const OcclusionRay* rays, int count, RayCounts* counts,
                                     std::uint8_t* occluded) {
  using Packets = OcclusionPackets<kMode, Real, Shape>;
  static thread_local typename Packets::Memory memory;
  Packets packets(job, shape, &memory, counts);
  for (int first = 0; first < count; first += kBundle) {
    packets.Cast(rays + first, std::min(kBundle, count - first), occluded + first);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#endif  // per target
