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
// New metaballs a window takes in, by the packet's number of rays. Large enough that most rays end
// in their first or second window, small enough that hidden metaballs are seldom touched.
constexpr int PacketWindowOf(int rays) { return rays >= 16 ? 40 : 32; }
// How many metaballs the march adds up between two looks at whether more are needed; windows are
// filled up to whole groups with passes of nothing. Two take a tenth off the sums' instructions,
// four and eight no more.
inline constexpr int kGroup = 2;
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
  static constexpr bool kBlended = kMode == ThresholdMode::kBlended;
  // What is kept of across2: the parabola's h where the bound works on that.
  static constexpr bool kParabola = !kBlended && TightBound<L, Shape>::kTakesParabola;

  struct OwnRadius {
    Real radius, inverse_radius;
  };
  struct OwnThreshold {
    Real threshold;
  };
  struct Nothing {};
  struct Unblended {};

 public:
  struct Entry : std::conditional_t<kOwnRadius, OwnRadius, Nothing>,
                 std::conditional_t<kBlended, OwnThreshold, Unblended> {
    Vec3<Real> center;  // relative to the window's anchor
    Real begins;        // its front from the window's start on, as the march counts
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
    Real lowest = INFINITY;    // threshold
    float last_exit = -INFINITY;
  };

  SHERD_PACKET_INLINE PacketWindow(const TileList& list, const Shape& shape, Memory* memory)
      : shape_(shape), list_(list), memory_(*memory) {
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

  // A metaball as a window at `start` with this anchor holds it.
  SHERD_PACKET_INLINE Entry EntryAt(const Anchor<Real>& anchor, double start, std::uint32_t idx,
                                    float front, float exit) const {
    Entry entry;
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
    return entry;
  }

  // Begins a window at `start`, whose anchor and rays these are: drops what lies behind and
  // computes the passes of the rest anew. enters: where each lane's first support begins at the
  // earliest, in the lengths that the march counts.
  SHERD_PACKET_INLINE void MoveTo(const Anchor<Real>& anchor, double start,
                                  const PacketRays<Real>& rays, M searching, L* enters) {
    *enters = L(INFINITY);
    extent_ = {};
    if constexpr (!kOwnRadius) extent_.smallest = uniform_radius_;
    if constexpr (!kBlended) {
      extent_.lowest = static_cast<Real>(list_.uniform_threshold * list_.threshold_scale);
    }
    const int carried = count_;
    count_ = 0;
    for (int k = 0; k < carried; ++k) {
      const Entry entry = memory_.entries[k];
      if (entry.exit > start) {
        Add(EntryAt(anchor, start, entry.idx, entry.front, entry.exit), rays, searching, enters);
      }
    }
  }
  // Makes room for so many more.
  SHERD_PACKET_INLINE void Reserve(int more) {
    const auto wanted = static_cast<std::size_t>(count_ + more);
    if (memory_.entries.size() >= wanted) return;
    memory_.entries.resize(2 * wanted);
    memory_.passes.resize(memory_.entries.size() * 2 * static_cast<std::size_t>(L::Count()));
  }
  // Takes in one metaball where a searching lane meets its support. There must be room.
  SHERD_PACKET_INLINE void Add(const Entry& entry, const PacketRays<Real>& rays, M searching,
                               L* enters) {
    const std::size_t stride = 2 * static_cast<std::size_t>(L::Count());
    Real* const pass = memory_.passes.data() + static_cast<std::size_t>(count_) * stride;
    if (!ComputePass(entry, rays, searching, pass, enters)) return;
    memory_.entries[count_++] = entry;
    extent_.last_exit = std::max(extent_.last_exit, entry.exit);
    if constexpr (kOwnRadius) extent_.smallest = std::min(extent_.smallest, entry.radius);
    if constexpr (kBlended) extent_.lowest = std::min(extent_.lowest, entry.threshold);
  }
  SHERD_PACKET_INLINE const Extent& extent() const { return extent_; }

  // A march through the window.
  struct Way {
    March<L, M> march;
    MarchLimits<L> limits;
    L lowest;  // threshold
    int steps;
  };

  // Where a march begins, for the lanes of `searching`, from `begin` on to t_end, which is nowhere
  // more than `longest`. All in the lengths that the march counts.
  SHERD_PACKET_INLINE Way Begin(L begin, L enters, L t_end, Real longest, M searching) {
    Reserve(kGroup);
    for (int k = count_; k < count_ + kGroup - 1; ++k) {
      memory_.entries[k] = memory_.entries[0];
      Real* const pass = memory_.passes.data() + static_cast<std::size_t>(2 * k * L::Count());
      L(kNoPass).Store(pass);
      L(kParabola ? 0 : 1).Store(pass + L::Count());
    }
    const Real smallest = extent_.smallest * LengthScale();
    Way way;
    // The field is zero up to where a lane's first support begins; what is taken off covers the
    // rounding of that place.
    way.march.t = Max(enters * L(1 - kFinest<Real>) - L(kDepthTolerance * smallest), begin);
    way.march.searching = Both(searching, way.march.t < t_end);
    way.march.dt = Min(L(static_cast<Real>(kFirstSegment) * smallest), t_end - way.march.t);
    way.march.hit = L(0) > L(0);
    way.limits = {
        L(std::max(static_cast<Real>(kDepthTolerance) * smallest, kFinest<Real> * longest)), t_end};
    way.lowest = L(extent_.lowest);
    way.steps = 0;
    return way;
  }

  // One step of a march of which a lane is searching. kGoal: whether the place of a crossing
  // matters; kOrdered: the entries came by rising front. Rare events are counted; a march whose
  // steps do not suffice ends.
  template <MarchGoal kGoal, bool kOrdered>
  SHERD_PACKET_INLINE void Step(Way* way, RayCounts* counts) const {
    if (++way->steps > kMaxStepsPerWindow) {
      counts->unresolved += way->march.searching.Count();
      way->march.searching = L(0) > L(0);
      return;
    }
    M grazing;
    if constexpr (kBlended) {
      BlendedBound<L, Shape> sums(shape_);
      AddAll<kOrdered>(way->march.t, way->march.dt, way->march.searching, &sums);
      grazing = AdvanceBlended<kGoal>(sums, way->lowest, way->limits, &way->march);
    } else {
      TightBound<L, Shape> bound(shape_);
      AddAll<kOrdered>(way->march.t, way->march.dt, way->march.searching, &bound);
      grazing = AdvanceUniform<kGoal>(bound.Sum(), way->lowest, way->limits, &way->march);
    }
    if (!grazing.None()) counts->grazing += grazing.Count();
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
    (kParabola ? L(1) - kept : kept).Store(pass + L::Count());
    // Half the chord, the root of h = 1 - across2, is at most (1 + h) / 2.
    const L begins = along * inverse_radius + L(0.5) * across2 - L(1);
    const L scaled = kOwnRadius ? begins * L(RadiusOf(entry)) : begins;
    *enters = Min(*enters, Where(meets, scaled, L(INFINITY)));
    return true;
  }

  // Adds the window's metaballs to a bound, in every lane on its own segment, a group at a time;
  // groups that no lane of `searching` can have entered by its segment's end are left out.
  template <bool kOrdered, class Bound>
  SHERD_PACKET_INLINE void AddAll(L t, L dt, M searching, Bound* bound) const {
    const Real farthest = LargestOf(Where(searching, t + dt, L(0)));
    const Entry* entry = memory_.entries.data();
    const Entry* const end = entry + count_;
    const Real* pass = memory_.passes.data();
    if constexpr (kOrdered) {
      for (; entry < end; entry += kGroup, pass += 2 * kGroup * L::Count()) {
        if (entry->begins > farthest) return;
        for (int k = 0; k < kGroup; ++k) AddTo(bound, entry[k], pass + 2 * k * L::Count(), t, dt);
      }
    } else {
      for (; entry != end; ++entry, pass += 2 * L::Count()) {
        if (!(entry->begins > farthest)) AddTo(bound, *entry, pass, t, dt);
      }
    }
  }

  template <class Bound>
  SHERD_PACKET_INLINE void AddTo(Bound* bound, const Entry& entry, const Real* pass, L t,
                                 L dt) const {
    const L b = L::Load(pass), kept = L::Load(pass + L::Count());
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

  const Shape shape_;
  const TileList& list_;
  Memory& memory_;
  int count_ = 0;
  Extent extent_;
  Real uniform_radius_ = Real(1), inverse_uniform_radius_ = Real(1);
};

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#endif  // per target
