// The metaballs that form the field on a stretch of a packet's way, and the steps of the march
// there: what packets of the camera's rays (packet_tracer-inl.h) and of shadow rays
// (appearance/occlusion_packets-inl.h) share. Included once for each instruction set.
//
// What each lane needs to know of a metaball, its pass (density/shapes.h), is computed once a
// window and kept: the march then reads two numbers a lane and metaball each step.

#if defined(SHERD_PACKET_WINDOW_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SHERD_PACKET_WINDOW_INL_H
#undef SHERD_PACKET_WINDOW_INL_H
#else
#define SHERD_PACKET_WINDOW_INL_H
#endif

#include <hwy/highway.h>
// After highway.h.
#include <hwy/contrib/math/math-inl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "metaball/packet_inline.h"
#include "metaball/tile_march.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#define SHERD_FORMULA SHERD_PACKET_INLINE HWY_MAYBE_UNUSED
#define SHERD_FORMULA_LAMBDA HWY_ATTR
#include "metaball/density/packet_math-inl.h"
//
#include "metaball/density/formulas-inl.h"
//
#include "metaball/march-inl.h"
#undef SHERD_FORMULA
#undef SHERD_FORMULA_LAMBDA

inline constexpr int kMaxLanes = 16;
// New metaballs a window takes in. Large enough that most rays end in their first or second window,
// small enough that hidden metaballs are seldom touched.
inline constexpr int kPacketWindow = 32;
// A pass far outside every segment: stands for "misses the support" and keeps b squared finite.
inline constexpr double kNoPass = 1e18;

// The rays of a packet in one window: o + t d in every lane, o counted from the window's anchor.
template <class Real>
struct PacketRays {
  HWY_ALIGN Real ox[kMaxLanes], oy[kMaxLanes], oz[kMaxLanes];
  HWY_ALIGN Real dx[kMaxLanes], dy[kMaxLanes], dz[kMaxLanes];  // unit
};

// kOwnRadius: each metaball has a radius of its own; where all have the same, the march counts its
// lengths in radii and radii cost nothing.
template <ThresholdMode kMode, class Real, bool kOwnRadius, class Shape>
class PacketWindow {
  using L = Lanes<Real>;
  using M = LaneMask<Real>;
  using D = typename L::D;
  static constexpr bool kBlended = kMode == ThresholdMode::kBlended;
  // What is kept of across2: the parabola's h where the bound works on that.
  static constexpr bool kParabola = !kBlended && TightBound<L, Shape>::kTakesParabola;

  struct OwnRadius {
    Real radius, inverse_radius;
  };
  struct NoRadius {};

 public:
  struct Entry : std::conditional_t<kOwnRadius, OwnRadius, NoRadius> {
    Vec3<Real> center;  // relative to the window's anchor
    Real threshold;
    Real begins;  // its front from the window's start on, as the march counts
    // Bounds of the distances at which any ray enters and leaves it, local units.
    float front, exit;
    std::uint32_t idx;
  };
  // Kept between packets; a worker thread traces one at a time.
  struct Memory {
    std::vector<Entry> entries;  // the window's, and room for more
    std::vector<Real> passes;    // per entry: b of every lane, then across2 or h of every lane
  };
  // What the march needs to know of the entries.
  struct Extent {
    Real smallest = INFINITY;  // radius
    Real lowest;               // threshold
    float last_exit = -INFINITY;
  };

  SHERD_PACKET_INLINE PacketWindow(const TileList& list, const Shape& shape, Memory* memory)
      : shape_(shape), list_(list), memory_(*memory), lanes_(static_cast<int>(hn::Lanes(D()))) {
    if constexpr (!kOwnRadius) {
      uniform_radius_ = list_.template RadiusOf<Real>(0);
      inverse_uniform_radius_ = Real(1) / uniform_radius_;
    }
  }

  SHERD_PACKET_INLINE int size() const { return count_; }
  SHERD_PACKET_INLINE std::span<const Entry> Entries() const {
    return {memory_.entries.data(), static_cast<std::size_t>(count_)};
  }
  SHERD_PACKET_INLINE void Clear() { count_ = 0; }
  SHERD_PACKET_INLINE Real RadiusOf(const Entry& entry) const {
    if constexpr (kOwnRadius) {
      return entry.radius;
    } else {
      return uniform_radius_;
    }
  }
  SHERD_PACKET_INLINE Real InverseRadiusOf(const Entry& entry) const {
    if constexpr (kOwnRadius) {
      return entry.inverse_radius;
    } else {
      return inverse_uniform_radius_;
    }
  }
  // The march counts in radii where these are all the same, else in local units.
  SHERD_PACKET_INLINE Real LengthScale() const {
    return kOwnRadius ? Real(1) : inverse_uniform_radius_;
  }
  SHERD_PACKET_INLINE L LocalFromMarch(L t) const {
    return kOwnRadius ? t : t * L(uniform_radius_);
  }

  // Begins a window at `start`, whose anchor and rays these are: drops what lies behind and
  // computes the passes of the rest anew. enters: where each lane's first support begins at the
  // earliest, in the lengths that the march counts.
  SHERD_PACKET_INLINE void MoveTo(const Anchor<Real>& anchor, double start,
                                  const PacketRays<Real>& rays, M searching, L* enters) {
    *enters = L(INFINITY);
    const int carried = count_;
    count_ = 0;
    for (int k = 0; k < carried; ++k) {
      const Entry entry = memory_.entries[k];
      if (entry.exit > start) {
        Add(anchor, start, entry.idx, entry.front, entry.exit, rays, searching, enters);
      }
    }
  }
  // Makes room for so many more.
  SHERD_PACKET_INLINE void Reserve(int more) {
    const auto wanted = static_cast<std::size_t>(count_ + more);
    if (memory_.entries.size() >= wanted) return;
    memory_.entries.resize(2 * wanted);
    memory_.passes.resize(memory_.entries.size() * 2 * static_cast<std::size_t>(lanes_));
  }
  // Takes in one metaball where a searching lane meets its support. There must be room.
  SHERD_PACKET_INLINE void Add(const Anchor<Real>& anchor, double start, std::uint32_t idx,
                               float front, float exit, const PacketRays<Real>& rays, M searching,
                               L* enters) {
    // Written in place, and kept where a lane meets it.
    Entry& entry = memory_.entries[count_];
    entry.idx = idx;
    entry.front = front;
    entry.exit = exit;
    entry.begins = static_cast<Real>(static_cast<double>(front) - start) * LengthScale();
    entry.center = anchor.To(list_.center[idx]);
    if constexpr (kOwnRadius) {
      entry.radius = list_.template RadiusOf<Real>(idx);
      entry.inverse_radius = Real(1) / entry.radius;
    }
    if constexpr (kBlended) entry.threshold = list_.template ThresholdOf<Real>(idx);
    const std::size_t stride = 2 * static_cast<std::size_t>(lanes_);
    count_ +=
        ComputePass(entry, rays, searching,
                    memory_.passes.data() + static_cast<std::size_t>(count_) * stride, enters);
  }

  SHERD_PACKET_INLINE Extent Measure() const {
    Extent extent;
    extent.lowest = static_cast<Real>(list_.uniform_threshold * list_.threshold_scale);
    if constexpr (kBlended) extent.lowest = INFINITY;
    for (const Entry& entry : Entries()) {
      extent.smallest = std::min(extent.smallest, RadiusOf(entry));
      if constexpr (kBlended) extent.lowest = std::min(extent.lowest, entry.threshold);
      extent.last_exit = std::max(extent.last_exit, entry.exit);
    }
    return extent;
  }

  // Marches from `begin` on (lanes of `searching` only) to t_end; smallest: the extent's. All in
  // the lengths that the march counts. kGoal: whether the place of a crossing matters; kOrdered:
  // the entries came by rising front. Rare events are counted.
  template <MarchGoal kGoal, bool kOrdered>
  SHERD_PACKET_INLINE March<L, M> Run(const Extent& extent, L begin, L enters, L t_end,
                                      Real longest, M searching, RayCounts* counts) const {
    const Real smallest = extent.smallest * LengthScale();
    March<L, M> march;
    // The field is zero up to where a lane's first support begins; what is taken off covers the
    // rounding of that place.
    march.t = Max(enters * L(1 - kFinest<Real>) - L(kDepthTolerance * smallest), begin);
    march.searching = Both(searching, march.t < t_end);
    march.dt = Min(L(static_cast<Real>(kFirstSegment) * smallest), t_end - march.t);
    march.hit = L(0) > L(0);
    const MarchLimits<L> limits{
        L(std::max(static_cast<Real>(kDepthTolerance) * smallest, kFinest<Real> * longest)), t_end};
    int steps = 0;
    while (!march.searching.None()) {
      if (++steps > kMaxStepsPerWindow) {
        counts->unresolved += march.searching.Count();
        break;
      }
      counts->grazing += Step<kGoal, kOrdered>(L(extent.lowest), limits, &march).Count();
    }
    return march;
  }

 private:
  // Computes the passes of one metaball; false when no searching lane meets its support.
  SHERD_PACKET_INLINE bool ComputePass(const Entry& entry, const PacketRays<Real>& rays,
                                       M searching, Real* pass, L* enters) const {
    const L cx = L(entry.center.x) - L::Load(rays.ox);
    const L cy = L(entry.center.y) - L::Load(rays.oy);
    const L cz = L(entry.center.z) - L::Load(rays.oz);
    const L dx = L::Load(rays.dx), dy = L::Load(rays.dy), dz = L::Load(rays.dz);
    const L along = cx * dx + cy * dy + cz * dz;
    const L px = cx - along * dx;
    const L py = cy - along * dy;
    const L pz = cz - along * dz;
    const L inverse_radius = L(InverseRadiusOf(entry));
    const L across2 = (px * px + py * py + pz * pz) * (inverse_radius * inverse_radius);
    const M meets = Both(searching, across2 < L(1));
    if (meets.None()) return false;
    Where(meets, along * inverse_radius, L(kNoPass)).Store(pass);
    const L kept = Where(meets, across2, L(1));
    (kParabola ? L(1) - kept : kept).Store(pass + lanes_);
    // Half the chord, the root of h = 1 - across2, is at most (1 + h) / 2.
    const L begins = along * inverse_radius + L(0.5) * across2 - L(1);
    const L scaled = kOwnRadius ? begins * L(RadiusOf(entry)) : begins;
    *enters = Min(*enters, Where(meets, scaled, L(INFINITY)));
    return true;
  }

  // Adds the window's metaballs to a bound, in every lane on its own segment; those that no lane
  // of `searching` can have entered by its segment's end are left out.
  template <bool kOrdered, class Bound>
  SHERD_PACKET_INLINE void AddAll(L t, L dt, M searching, Bound* bound) const {
    const Real farthest = LargestOf(Where(searching, t + dt, L(0)));
    const Real* pass = memory_.passes.data();
    for (const Entry& entry : Entries()) {
      const Real* const at = pass;
      pass += 2 * lanes_;
      if (entry.begins > farthest) {
        if constexpr (kOrdered) return;
        continue;
      }
      const L b = L::Load(at), kept = L::Load(at + lanes_);
      L s0, s1;
      if constexpr (kOwnRadius) {
        const L inverse_radius = L(entry.inverse_radius);
        s0 = t * inverse_radius - b;
        s1 = s0 + dt * inverse_radius;
      } else {
        s0 = t - b;
        s1 = s0 + dt;
      }
      if constexpr (kBlended) {
        bound->Add(s0, s1, kept, L(entry.threshold));
      } else if constexpr (kParabola) {
        bound->AddParabola(s0, s1, kept);
      } else {
        bound->Add(s0, s1, kept);
      }
    }
  }

  template <MarchGoal kGoal, bool kOrdered>
  SHERD_PACKET_INLINE M Step(L lowest, const MarchLimits<L>& limits, March<L, M>* march) const {
    if constexpr (kBlended) {
      BlendedBound<L, Shape> sums(shape_);
      AddAll<kOrdered>(march->t, march->dt, march->searching, &sums);
      return AdvanceBlended<kGoal>(sums, lowest, limits, march);
    } else {
      TightBound<L, Shape> bound(shape_);
      AddAll<kOrdered>(march->t, march->dt, march->searching, &bound);
      return AdvanceUniform<kGoal>(bound.Sum(), lowest, limits, march);
    }
  }

  const Shape shape_;
  const TileList& list_;
  Memory& memory_;
  const int lanes_;
  int count_ = 0;
  Real uniform_radius_ = Real(1), inverse_uniform_radius_ = Real(1);
};

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#endif  // per target
