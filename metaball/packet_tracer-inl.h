// Packets of rays: the march of tile_march.h with a ray in every lane. One screen tile at a time,
// the widest vectors the machine has (Highway's run-time dispatch): included once for each
// instruction set by the packet_tracer_*.cc.

#if defined(SHERD_PACKET_TRACER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SHERD_PACKET_TRACER_INL_H
#undef SHERD_PACKET_TRACER_INL_H
#else
#define SHERD_PACKET_TRACER_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <type_traits>
#include <vector>

#include "metaball/camera_rays-inl.h"
#include "metaball/packet_window-inl.h"
#include "metaball/trace_job.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

// One screen tile of one frame, in packets.
//
// Two packets are on their way at a time, a step of one after a step of the other: a step ends in a
// long chain of operations that wait for each other, and the machine fills that time with the other
// packet's sums.
template <ThresholdMode kMode, class Real, bool kOwnRadius, class Shape>
class PacketTracer {
  using L = Lanes<Real>;
  using M = LaneMask<Real>;
  using F = Lanes<float>;
  static constexpr bool kBlended = kMode == ThresholdMode::kBlended;
  // A value so cheap that asking whether any lane needs it costs more.
  static constexpr bool kCheap = std::is_base_of_v<PowerShape, Shape>;
  // Beyond the support nothing need be cut off.
  static constexpr bool kFlatRim = requires { requires Shape::kFlatRim; };
  using Window = PacketWindow<kMode, Real, kOwnRadius, Shape>;
  using Entry = typename Window::Entry;

 public:
  // Kept between tiles; a worker thread traces one tile at a time.
  struct Memory {
    typename Window::Memory windows[2];
    // The beginning of the tile's list: as the first window of every packet holds it, and in arrays
    // for the packets to choose from: centres relative to the tile's anchor, radii, exits.
    std::vector<Entry> entries;
    std::vector<float> x, y, z, radius, exit;
  };

  SHERD_PACKET_INLINE PacketTracer(const TraceJob& job, const Shape& shape, int tile,
                                   Memory* memory, TraceCounts* counts)
      : job_(job),
        shape_(shape),
        list_(job.ListOf(tile)),
        memory_(*memory),
        counts_(*counts),
        packets_{Packet(list_, shape, &memory->windows[0]),
                 Packet(list_, shape, &memory->windows[1])} {}

  SHERD_PACKET_INLINE void Run(int tile) {
    pixels_ = job_.bins->PixelsOf(tile);
    x_ = pixels_.x0;
    y_ = pixels_.y0;
    list_front_ = list_.entry[0].front;
    const RayD middle = RayThrough(job_.camera, x_ + 0.5 * kTileSize, y_ + 0.5 * kTileSize);
    tile_anchor_ = middle.origin + middle.direction * list_front_;
    staged_ = 0;
    for (bool any = true; any;) {
      any = false;
      for (Packet& packet : packets_) {
        if (packet.way.march.searching.None() && !Proceed(&packet)) continue;
        if (counts_.rays.crowded > 0) return;
        packet.window.template Step<MarchGoal::kFirst, true>(&packet.way, &counts_.rays);
        any = true;
      }
    }
  }

 private:
  // A packet on its way through the list, window by window.
  struct Packet {
    SHERD_PACKET_INLINE Packet(const TileList& list, const Shape& shape,
                               typename Window::Memory* memory)
        : window(list, shape, memory) {
      searching = way.march.searching = way.march.hit = L(0) > L(0);
    }

    CameraRays<Real> rays;
    Vec3f origin, direction;  // the middle ray at the list's front, from the tile's anchor
    M searching;              // no crossing yet
    Window window;
    typename Window::Way way;
    double start = 0.0, following = 0.0;  // of the window, and of the one after it
    int next = 0;                         // in the list: the first metaball not taken in
  };

  static SHERD_PACKET_INLINE L InverseSquare(Real inverse_radius) {
    return L(inverse_radius * inverse_radius);
  }

  // Ends the packet's march, if it was on one, and takes it to its next: in its next window, or as
  // another packet of the tile. False when there is none, or where floats do not suffice.
  SHERD_PACKET_INLINE bool Proceed(Packet* p) {
    March<L, M>& march = p->way.march;
    if (!march.hit.None()) {
      counts_.hits += march.hit.Count();
      if (!(p->start > 0.0)) {
        counts_.rays.started_inside += Both(march.hit, march.t <= L(0)).Count();
      }
      ShadeHits(*p, march.t, march.hit);
      p->searching = Both(p->searching, Not(march.hit));
      march.hit = L(0) > L(0);
    }
    for (;;) {
      while (p->next < list_.count && !p->searching.None()) {
        p->start = p->following;
        if (NextWindow(p)) return true;
        if (counts_.rays.crowded > 0) return false;
      }
      if (y_ >= pixels_.y1) return false;
      p->rays.Aim(job_.camera, x_, y_);
      p->searching = p->rays.InPicture(job_.frame->width, job_.frame->height);
      p->window.Clear();
      p->following = list_front_;
      p->next = 0;
      const RayD& axis = p->rays.axis();
      p->origin =
          (axis.origin + axis.direction * list_front_ - tile_anchor_).template cast<float>();
      p->direction = axis.direction.template cast<float>();
      x_ += p->rays.width();
      if (x_ >= pixels_.x1) {
        x_ = pixels_.x0;
        y_ += p->rays.height();
      }
    }
  }

  // Makes the arrays hold at least the first `wanted` metaballs of the list, and some padding.
  SHERD_PACKET_INLINE void Stage(const Window& window, int wanted) {
    if (wanted <= staged_) return;
    const int until = std::min(list_.count, std::max(wanted, 2 * staged_ + 64));
    const std::size_t room = static_cast<std::size_t>(until) + kMaxLanes;
    if (memory_.x.size() < room) {
      for (auto* array : {&memory_.x, &memory_.y, &memory_.z, &memory_.radius, &memory_.exit}) {
        array->resize(2 * room);
      }
      memory_.entries.resize(2 * room);
    }
    const Anchor<Real> anchor(tile_anchor_);
    for (int k = staged_; k < until; ++k) {
      const auto [idx, front] = list_.entry[k];
      const float radius = list_.template RadiusOf<float>(idx);
      // The front errs by at most 1e-6 of the distance, which the factor covers twice.
      const float exit = front + 2.0f * radius + 4e-6f * (std::abs(front) + radius);
      const Entry entry = window.EntryAt(anchor, list_front_, idx, front, exit);
      memory_.entries[k] = entry;
      memory_.x[k] = static_cast<float>(entry.center.x);
      memory_.y[k] = static_cast<float>(entry.center.y);
      memory_.z[k] = static_cast<float>(entry.center.z);
      memory_.radius[k] = radius;
      memory_.exit[k] = exit;
    }
    for (int k = until; k < until + kMaxLanes; ++k) memory_.exit[k] = -INFINITY;
    staged_ = until;
  }

  // Which of the staged metaballs from position k on (bit 0) may be met by a ray of the packet
  // beyond its window's start: those within the packet's spread of its middle ray.
  SHERD_PACKET_INLINE std::uint32_t InReach(const Packet& p, int k) const {
    const Vec3f& axis = p.direction;
    const F x = F::Load(&memory_.x[k]) - F(p.origin.x);
    const F y = F::Load(&memory_.y[k]) - F(p.origin.y);
    const F z = F::Load(&memory_.z[k]) - F(p.origin.z);
    const F radius = F::Load(&memory_.radius[k]);
    const F along = x * F(axis.x) + y * F(axis.y) + z * F(axis.z);
    const F px = x - along * F(axis.x), py = y - along * F(axis.y), pz = z - along * F(axis.z);
    const F across2 = px * px + py * py + pz * pz;
    // At least as far as any point of the support is from the middle ray's at the list's front.
    const F size = Absolute(x) + Absolute(y) + Absolute(z) + radius;
    const F widest = F(p.rays.widest());
    const F spread = job_.camera.projection == Projection::kPerspective
                         ? widest * (F(list_front_) + size)
                         : widest;
    const F reach = radius * F(1.0001) + spread + size * F(1e-6);
    const LaneMask<float> in =
        Both(across2 <= reach * reach, F::Load(&memory_.exit[k]) > F(p.start));
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(typename F::D(), in.m, bits);
    return bits[0] | static_cast<std::uint32_t>(bits[1]) << 8;
  }

  // Moves the window on to the packet's `start`: drops what lies behind, takes in the next
  // metaballs of the list. enters: as the window has it.
  SHERD_PACKET_INLINE void FillWindow(Packet* p, L* enters) {
    const bool first = p->next == 0;  // and as staged
    const Vec3d point = first ? tile_anchor_ : p->rays.PointAt(p->start);
    p->rays.CountFrom(point, p->start);
    const Anchor<Real> anchor(point);
    Window& window = p->window;
    window.MoveTo(anchor, p->start, p->rays.rays(), p->searching, enters);
    const int wanted = window.size() + PacketWindowOf(L::Count());
    const int chunk = F::Count();
    while (p->next < list_.count) {
      Stage(window, std::min(list_.count, p->next + chunk));
      window.Reserve(chunk);
      std::uint32_t candidates = InReach(*p, p->next);
      for (; candidates != 0; candidates &= candidates - 1) {
        const int k = p->next + std::countr_zero(candidates);
        const Entry& staged = memory_.entries[k];
        if (window.size() >= wanted && staged.front > p->start) {
          p->next = k;
          return;
        }
        if (first) {
          window.Add(staged, p->rays.rays(), p->searching, enters);
        } else {
          window.Add(window.EntryAt(anchor, p->start, staged.idx, staged.front, staged.exit),
                     p->rays.rays(), p->searching, enters);
        }
      }
      p->next = std::min(list_.count, p->next + chunk);
    }
  }

  // Begins the march through the next window; false where there is nothing to march through, or
  // where floats do not suffice.
  SHERD_PACKET_INLINE bool NextWindow(Packet* p) {
    Window& window = p->window;
    L enters;
    FillWindow(p, &enters);
    if (sizeof(Real) == 4 && window.size() > job_.float_overlap) {
      ++counts_.rays.crowded;
      return false;
    }
    const double end = p->next < list_.count ? static_cast<double>(list_.entry[p->next].front)
                                             : static_cast<double>(INFINITY);
    p->following = std::max(p->start, end);
    if (window.size() == 0) return false;
    const double room = std::min(static_cast<double>(window.extent().last_exit), end) - p->start;
    const Real t_end = static_cast<Real>(room) * window.LengthScale();
    if (!(t_end > Real(0))) return false;
    p->way = window.Begin(L(0), enters, L(t_end), t_end, p->searching);
    return !p->way.march.searching.None();
  }

  // shading.h's SurfaceSums, normals and light in every lane, then lane by lane into the frame.
  // march_t: as the march counts it.
  SHERD_PACKET_INLINE void ShadeHits(const Packet& p, L march_t, M hit) const {
    const Window& window = p.window;
    const PacketRays<Real>& rays = p.rays.rays();
    const Real farthest = LargestOf(Where(hit, march_t, L(0)));
    const L t = window.LocalFromMarch(march_t);
    const float* table = SrgbToLinearTable();
    const Cloud& cloud = *job_.cloud;
    const Rgb8* const colors = cloud.color.empty() ? nullptr : cloud.color.data();
    const bool want_id = !job_.frame->id.empty();
    const L x = t * L::Load(rays.dx) + L::Load(rays.ox);
    const L y = t * L::Load(rays.dy) + L::Load(rays.oy);
    const L z = t * L::Load(rays.dz) + L::Load(rays.oz);
    const L zero = L(0), one = L(1);
    L weight = zero, r = zero, g = zero, b = zero, nx = zero, ny = zero, nz = zero;
    L tx = zero, ty = zero, tz = zero;  // of the thresholds
    L strongest = L(-INFINITY), strongest_entry = zero;
    const std::span<const Entry> entries = window.Entries();
    const L uniform = InverseSquare(window.InverseRadiusOf(entries[0]));
    for (std::size_t k = 0; k < entries.size(); ++k) {
      const Entry& entry = entries[k];
      if (entry.begins > farthest) break;
      const L inverse_r2 = kOwnRadius ? InverseSquare(window.InverseRadiusOf(entry)) : uniform;
      const L ex = x - L(entry.center.x);
      const L ey = y - L(entry.center.y);
      const L ez = z - L(entry.center.z);
      const L u = (ex * ex + ey * ey + ez * ez) * inverse_r2;
      const M in = u < one;
      if (!kCheap && in.None()) continue;
      const L within = Min(u, one);
      const L value = shape_.Value(within), slope_u = zero - shape_.Slope(within);
      const L f = kFlatRim ? value : Where(in, value, zero);
      const L positive = Max(f, zero);
      const Rgb8 color = colors ? colors[entry.idx] : cloud.uniform_color;
      weight = weight + positive;
      r = positive * L(table[color.r]) + r;
      g = positive * L(table[color.g]) + g;
      b = positive * L(table[color.b]) + b;
      const L slope = (kFlatRim ? slope_u : Where(in, slope_u, zero)) * inverse_r2;
      nx = slope * ex + nx;
      ny = slope * ey + ny;
      nz = slope * ez + nz;
      if constexpr (kBlended) {
        const L threshold_slope = slope * L(entry.threshold);
        tx = threshold_slope * ex + tx;
        ty = threshold_slope * ey + ty;
        tz = threshold_slope * ez + tz;
      }
      if (want_id) {
        const M stronger = Both(in, f > strongest);
        strongest = Where(stronger, f, strongest);
        strongest_entry = Where(stronger, L(static_cast<int>(k)), strongest_entry);
      }
    }
    if constexpr (kBlended) {
      // SurfaceSums::BlendedNormal.
      const L twice = L(2) * weight;
      nx = twice * nx - tx;
      ny = twice * ny - ty;
      nz = twice * nz - tz;
    }
    // vec.h's Normalized, with the viewer's direction to fall back on.
    const L to_x = zero - L::Load(rays.dx), to_y = zero - L::Load(rays.dy),
            to_z = zero - L::Load(rays.dz);
    const L length = SquareRoot(nx * nx + ny * ny + nz * nz);
    const M directed = Both(length > zero, length < L(INFINITY));
    const L inverse_length = one / Where(directed, length, one);
    nx = Where(directed, nx * inverse_length, to_x);
    ny = Where(directed, ny * inverse_length, to_y);
    nz = Where(directed, nz * inverse_length, to_z);
    // shading.h's Shade.
    L factor = one / Where(weight > zero, weight, one);
    const FrameLight& light = job_.light;
    if (!light.unlit) {
      const L cosine = light.headlight ? nx * to_x + ny * to_y + nz * to_z
                                       : nx * L(light.to_light.x) + ny * L(light.to_light.y) +
                                             nz * L(light.to_light.z);
      factor = factor * (L(light.ambient) + L(light.diffuse) * Max(cosine, zero));
    }
    const L brightest = L(light.unlit ? INFINITY : 1.0f);
    HWY_ALIGN Real value[8][kMaxLanes];
    HWY_ALIGN Real is_hit[kMaxLanes];
    Min(r * factor, brightest).Store(value[0]);
    Min(g * factor, brightest).Store(value[1]);
    Min(b * factor, brightest).Store(value[2]);
    nx.Store(value[3]);
    ny.Store(value[4]);
    nz.Store(value[5]);
    t.Store(value[6]);
    strongest_entry.Store(value[7]);
    Where(hit, one, zero).Store(is_hit);
    Frame& frame = *job_.frame;
    std::vector<GatherSphere>* const spheres = job_.gather ? &GatherScratch() : nullptr;
    if (spheres) {
      for (const Entry& entry : entries) {
        spheres->push_back({entry.center.template cast<float>(),
                            static_cast<float>(window.InverseRadiusOf(entry)), entry.idx});
      }
    }
    for (int i = 0; i < L::Count(); ++i) {
      if (is_hit[i] == Real(0)) continue;
      const std::size_t pixel =
          static_cast<std::size_t>(p.rays.PixelY(i)) * frame.width + p.rays.PixelX(i);
      frame.color[pixel] = {static_cast<float>(value[0][i]), static_cast<float>(value[1][i]),
                            static_cast<float>(value[2][i]), 1.0f};
      if (!frame.depth.empty()) {
        frame.depth[pixel] =
            WorldDepth(p.start + static_cast<double>(value[6][i]), cloud.frame.unit);
      }
      if (!frame.normal.empty()) {
        frame.normal[pixel] =
            Vec3<Real>{value[3][i], value[4][i], value[5][i]}.template cast<float>();
      }
      if (want_id) {
        const Entry& entry = entries[static_cast<std::size_t>(value[7][i])];
        frame.id[pixel] = static_cast<std::int32_t>(entry.idx);
      }
      if (spheres) {
        const Vec3<Real> point = Vec3<Real>{rays.ox[i], rays.oy[i], rays.oz[i]} +
                                 Vec3<Real>{rays.dx[i], rays.dy[i], rays.dz[i]} * value[6][i];
        job_.gather->AtHit(pixel, point.template cast<float>(), *spheres);
      }
    }
  }

  const TraceJob& job_;
  const Shape shape_;
  const TileList list_;
  Memory& memory_;
  TraceCounts& counts_;
  Packet packets_[2];
  PixelBox pixels_;          // the tile's
  int x_ = 0, y_ = 0;        // where the next packet begins
  double list_front_ = 0.0;  // where the list begins, and a point of the tile's middle ray there
  Vec3d tile_anchor_;
  int staged_ = 0;
};

template <ThresholdMode kMode, class Real>
void TraceTilePackets(const TraceJob& job, int tile, TraceCounts* counts) {
  // Qualified: the argument would find the scalar one as well.
  HWY_NAMESPACE::WithShape(job.shape, [&](const auto& shape) HWY_ATTR {
    const auto trace = [&]<bool kOwnRadius>() HWY_ATTR {
      using Tracer = PacketTracer<kMode, Real, kOwnRadius, std::decay_t<decltype(shape)>>;
      static thread_local typename Tracer::Memory memory;
      Tracer(job, shape, tile, &memory, counts).Run(tile);
    };
    // What most scenes use is there in both forms; the others draw equal radii as if each metaball
    // had its own.
    constexpr bool kUsual = kMode == ThresholdMode::kUniform && std::is_same_v<Real, float>;
    if constexpr (kUsual) {
      if (job.cloud->radius.empty()) return trace.template operator()<false>();
    }
    trace.template operator()<true>();
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#endif  // per target
