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

#include "metaball/packet_window-inl.h"
#include "metaball/trace_job.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

// One screen tile of one frame, in packets.
template <ThresholdMode kMode, class Real, bool kOwnRadius, class Shape>
class PacketTracer {
  using L = Lanes<Real>;
  using M = LaneMask<Real>;
  using D = typename L::D;
  using F = Lanes<float>;
  static constexpr bool kBlended = kMode == ThresholdMode::kBlended;
  // A value so cheap that asking whether any lane needs it costs more.
  static constexpr bool kCheap = std::is_base_of_v<PowerShape, Shape>;
  using Window = PacketWindow<kMode, Real, kOwnRadius, Shape>;
  using Entry = typename Window::Entry;

 public:
  // Kept between tiles; a worker thread traces one tile at a time.
  struct Memory {
    typename Window::Memory window;
    // The beginning of the tile's list in arrays, for all of its packets: centres relative to the
    // tile's anchor, radii, and the fronts and exits of Entry.
    std::vector<float> x, y, z, radius, front, exit;
  };

  SHERD_PACKET_INLINE PacketTracer(const TraceJob& job, const Shape& shape, int tile,
                                   Memory* memory, TraceCounts* counts)
      : job_(job),
        shape_(shape),
        list_(job.ListOf(tile)),
        memory_(*memory),
        counts_(*counts),
        window_(list_, shape, &memory->window) {}

  SHERD_PACKET_INLINE void Run(int tile) {
    const Frame& frame = *job_.frame;
    const int x0 = tile % job_.bins->tiles_x() * kTileSize;
    const int y0 = tile / job_.bins->tiles_x() * kTileSize;
    lanes_ = static_cast<int>(hn::Lanes(D()));
    width_ = lanes_ >= 8 ? 4 : lanes_ >= 4 ? 2 : 1;
    const int height = lanes_ / width_;
    for (int i = 0; i < lanes_; ++i) {
      lane_x_[i] = static_cast<Real>(i % width_);
      lane_y_[i] = static_cast<Real>(i / width_);
    }
    list_front_ = list_.entry[0].front;
    const RayD middle = RayThrough(job_.camera, x0 + 0.5 * kTileSize, y0 + 0.5 * kTileSize);
    tile_anchor_ = middle.origin + middle.direction * list_front_;
    staged_ = 0;
    for (int y = y0; y < std::min(y0 + kTileSize, frame.height); y += height) {
      for (int x = x0; x < std::min(x0 + kTileSize, frame.width); x += width_) {
        x0_ = x;
        y0_ = y;
        AimRays(x + 0.5 * width_, y + 0.5 * height, 0.5 * (width_ - 1), 0.5 * (height - 1));
        TracePacket(
            Both(L::Load(lane_x_) < L(frame.width - x), L::Load(lane_y_) < L(frame.height - y)));
        if (counts_.rays.crowded > 0) return;
      }
    }
  }

 private:
  // The rays of a packet around its middle ray, which is found in doubles. Their differences from
  // it are found as differences and so keep their own accuracy: with c the middle ray's direction
  // before it is made a unit vector, e the step on the picture plane, u = c + e and m = |u|^2 -
  // |c|^2,
  //   u / |u| - c / |c| = e / |u| - c m / (|u| |c| (|u| + |c|)).
  SHERD_PACKET_INLINE void AimRays(double x, double y, double middle_x, double middle_y) {
    const Camera& camera = job_.camera;
    axis_ = RayThrough(camera, x, y);
    const L step_x = (L::Load(lane_x_) - L(middle_x)) * L(1.0 / camera.fx);
    const L step_y = (L::Load(lane_y_) - L(middle_y)) * L(1.0 / camera.fy);
    L ex = step_x * L(camera.right.x) + step_y * L(camera.down.x);
    L ey = step_x * L(camera.right.y) + step_y * L(camera.down.y);
    L ez = step_x * L(camera.right.z) + step_y * L(camera.down.z);
    const L ax = L(axis_.direction.x), ay = L(axis_.direction.y), az = L(axis_.direction.z);
    if (camera.projection == Projection::kPerspective) {
      const double length = std::sqrt(1.0 + Square((x - camera.cx) / camera.fx) +
                                      Square((y - camera.cy) / camera.fy));
      const L c = L(length);
      const L cx = ax * c, cy = ay * c, cz = az * c;
      const L m = L(2) * (cx * ex + cy * ey + cz * ez) + (ex * ex + ey * ey + ez * ez);
      const L u = SquareRoot(c * c + m);
      const L along_e = L(1) / u, along_c = m / (u * c * (u + c));
      ex = ex * along_e - cx * along_c;
      ey = ey * along_e - cy * along_c;
      ez = ez * along_e - cz * along_c;
      (ax + ex).Store(rays_.dx);
      (ay + ey).Store(rays_.dy);
      (az + ez).Store(rays_.dz);
    } else {
      ax.Store(rays_.dx);
      ay.Store(rays_.dy);
      az.Store(rays_.dz);
    }
    ex.Store(sx_);
    ey.Store(sy_);
    ez.Store(sz_);
    double widest2 = 0;
    for (int i = 0; i < lanes_; ++i) {
      widest2 = std::max(widest2, Square(sx_[i]) + Square(sy_[i]) + Square(sz_[i]));
    }
    widest_ = std::sqrt(widest2) * 1.0001;
  }
  static SHERD_PACKET_INLINE double Square(double v) { return v * v; }

  // Counts the coordinates of a window from the point of the packet's middle ray at depth `start`.
  SHERD_PACKET_INLINE Anchor<Real> PlaceAnchor(double start) {
    const L reach = L(job_.camera.projection == Projection::kPerspective ? start : 1.0);
    (L::Load(sx_) * reach).Store(rays_.ox);
    (L::Load(sy_) * reach).Store(rays_.oy);
    (L::Load(sz_) * reach).Store(rays_.oz);
    return Anchor<Real>(axis_.origin + axis_.direction * start);
  }

  // Makes the arrays hold at least the first `wanted` metaballs of the list, and some padding.
  SHERD_PACKET_INLINE void Stage(int wanted) {
    if (wanted <= staged_) return;
    const int until = std::min(list_.count, std::max(wanted, 2 * staged_ + 64));
    const std::size_t room = static_cast<std::size_t>(until) + kMaxLanes;
    if (memory_.x.size() < room) {
      for (auto* array :
           {&memory_.x, &memory_.y, &memory_.z, &memory_.radius, &memory_.front, &memory_.exit}) {
        array->resize(2 * room);
      }
    }
    const SplitPoint anchor = SplitPoint::From(tile_anchor_);
    for (int k = staged_; k < until; ++k) {
      const auto [idx, front] = list_.entry[k];
      const Vec3f center = Minus(list_.center[idx], anchor);
      const float radius = list_.template RadiusOf<float>(idx);
      memory_.x[k] = center.x;
      memory_.y[k] = center.y;
      memory_.z[k] = center.z;
      memory_.radius[k] = radius;
      // The front errs by at most 1e-6 of the distance, which the factor covers twice.
      memory_.front[k] = front;
      memory_.exit[k] = front + 2.0f * radius + 4e-6f * (std::abs(front) + radius);
    }
    for (int k = until; k < until + kMaxLanes; ++k) memory_.exit[k] = -INFINITY;
    staged_ = until;
  }

  // Which of the staged metaballs from position k on (bit 0) may be met by a ray of the packet
  // beyond `start`: those within the packet's spread of its middle ray. Rays of a perspective
  // packet are at distance t at most t * widest from it.
  SHERD_PACKET_INLINE std::uint32_t InReach(int k, float start) const {
    const Vec3f origin =
        (axis_.origin + axis_.direction * list_front_ - tile_anchor_).template cast<float>();
    const Vec3f axis = axis_.direction.template cast<float>();
    const F x = F::Load(&memory_.x[k]) - F(origin.x);
    const F y = F::Load(&memory_.y[k]) - F(origin.y);
    const F z = F::Load(&memory_.z[k]) - F(origin.z);
    const F radius = F::Load(&memory_.radius[k]);
    const F across_x = y * F(axis.z) - z * F(axis.y);
    const F across_y = z * F(axis.x) - x * F(axis.z);
    const F across_z = x * F(axis.y) - y * F(axis.x);
    const F along = x * F(axis.x) + y * F(axis.y) + z * F(axis.z);
    const F zero = F(0);
    const F size = Max(x, zero - x) + Max(y, zero - y) + Max(z, zero - z) + radius;
    const F across2 = across_x * across_x + across_y * across_y + across_z * across_z;
    const F depth = along + F(list_front_);
    const F distance = Max(depth, zero - depth) + SquareRoot(across2);  // from the eye, at most
    const F widest = F(widest_);
    const F spread =
        job_.camera.projection == Projection::kPerspective ? widest * (distance + radius) : widest;
    const F reach = radius * F(1.0001) + spread + size * F(1e-6);
    const LaneMask<float> in = Both(across2 <= reach * reach, F::Load(&memory_.exit[k]) > F(start));
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(typename F::D(), in.m, bits);
    return bits[0] | static_cast<std::uint32_t>(bits[1]) << 8;
  }

  // Moves the window on: drops what lies behind `start`, takes in the next metaballs of the list,
  // and computes every pass anew. Returns the position in the list of the first metaball not taken
  // in. enters: as the window has it.
  SHERD_PACKET_INLINE int FillWindow(const Anchor<Real>& anchor, double start, int next,
                                     M searching, L* enters) {
    window_.MoveTo(anchor, start, rays_, searching, enters);
    const int wanted = window_.size() + kPacketWindow;
    const int chunk = static_cast<int>(hn::Lanes(typename F::D()));
    while (next < list_.count) {
      Stage(std::min(list_.count, next + chunk));
      window_.Reserve(chunk);
      std::uint32_t candidates = InReach(next, static_cast<float>(start));
      for (; candidates != 0; candidates &= candidates - 1) {
        const int k = next + std::countr_zero(candidates);
        if (window_.size() >= wanted && memory_.front[k] > start) return k;
        window_.Add(anchor, start, list_.entry[k].metaball, memory_.front[k], memory_.exit[k],
                    rays_, searching, enters);
      }
      next = std::min(list_.count, next + chunk);
    }
    return next;
  }

  SHERD_PACKET_INLINE void TracePacket(M active) {
    window_.Clear();
    double start = list_front_;
    M searching = active;
    int next = 0;
    while (!searching.None()) {
      const Anchor<Real> anchor = PlaceAnchor(start);
      L enters;
      next = FillWindow(anchor, start, next, searching, &enters);
      if (sizeof(Real) == 4 && window_.size() > job_.float_overlap) {
        ++counts_.rays.crowded;
        return;
      }
      const bool last = next == list_.count;
      const double end = last ? 0.0 : static_cast<double>(list_.entry[next].front);
      if (window_.size() == 0) {
        if (last) return;
        start = end;
        continue;
      }
      const typename Window::Extent extent = window_.Measure();
      const double room = static_cast<double>(extent.last_exit) - start;
      const Real t_end =
          static_cast<Real>(last ? room : std::min(room, end - start)) * window_.LengthScale();
      if (t_end > Real(0)) {
        const March<L, M> march = window_.template Run<MarchGoal::kFirst, true>(
            extent, L(0), enters, L(t_end), t_end, searching, &counts_.rays);
        if (!march.hit.None()) {
          counts_.hits += march.hit.Count();
          if (!(start > 0.0)) {
            counts_.rays.started_inside += Both(march.hit, march.t <= L(0)).Count();
          }
          ShadeHits(march.t, march.hit, start);
          searching = Both(searching, Not(march.hit));
        }
      }
      if (last) return;
      start = std::max(start, end);
    }
  }

  // shading.h's SurfaceSums, normals and light in every lane, then lane by lane into the frame.
  // march_t: as the march counts it.
  SHERD_PACKET_INLINE void ShadeHits(L march_t, M hit, double start) const {
    const Real farthest = LargestOf(Where(hit, march_t, L(0)));
    const L t = window_.LocalFromMarch(march_t);
    const float* table = SrgbToLinearTable();
    const Cloud& cloud = *job_.cloud;
    const bool want_id = !job_.frame->id.empty();
    const L x = t * L::Load(rays_.dx) + L::Load(rays_.ox);
    const L y = t * L::Load(rays_.dy) + L::Load(rays_.oy);
    const L z = t * L::Load(rays_.dz) + L::Load(rays_.oz);
    const L zero = L(0), one = L(1);
    L weight = zero, r = zero, g = zero, b = zero, nx = zero, ny = zero, nz = zero;
    L tx = zero, ty = zero, tz = zero;  // of the thresholds
    L strongest = L(-INFINITY), strongest_entry = zero;
    const std::span<const Entry> entries = window_.Entries();
    for (std::size_t k = 0; k < entries.size(); ++k) {
      const Entry& entry = entries[k];
      if (entry.begins > farthest) break;
      const L inverse_r2 = L(window_.InverseRadiusOf(entry) * window_.InverseRadiusOf(entry));
      const L ex = x - L(entry.center.x);
      const L ey = y - L(entry.center.y);
      const L ez = z - L(entry.center.z);
      const L u = (ex * ex + ey * ey + ez * ez) * inverse_r2;
      const M in = u < one;
      if (!kCheap && in.None()) continue;
      const L f = Where(in, shape_.Value(Min(u, one)), zero);
      const L positive = Max(f, zero);
      const Rgb8 color = cloud.color.empty() ? cloud.uniform_color : cloud.color[entry.idx];
      weight = weight + positive;
      r = positive * L(table[color.r]) + r;
      g = positive * L(table[color.g]) + g;
      b = positive * L(table[color.b]) + b;
      const L slope = Where(in, (zero - shape_.Slope(Min(u, one))) * inverse_r2, zero);
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
    const L to_x = zero - L::Load(rays_.dx), to_y = zero - L::Load(rays_.dy),
            to_z = zero - L::Load(rays_.dz);
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
                            static_cast<float>(window_.InverseRadiusOf(entry)), entry.idx});
      }
    }
    for (int i = 0; i < lanes_; ++i) {
      if (is_hit[i] == Real(0)) continue;
      const std::size_t pixel =
          static_cast<std::size_t>(y0_ + i / width_) * frame.width + x0_ + i % width_;
      frame.color[pixel] = {static_cast<float>(value[0][i]), static_cast<float>(value[1][i]),
                            static_cast<float>(value[2][i]), 1.0f};
      if (!frame.depth.empty()) {
        frame.depth[pixel] = WorldDepth(start + static_cast<double>(value[6][i]), cloud.frame.unit);
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
        const Vec3<Real> point = Vec3<Real>{rays_.ox[i], rays_.oy[i], rays_.oz[i]} +
                                 Vec3<Real>{rays_.dx[i], rays_.dy[i], rays_.dz[i]} * value[6][i];
        job_.gather->AtHit(pixel, point.template cast<float>(), *spheres);
      }
    }
  }

  const TraceJob& job_;
  const Shape shape_;
  const TileList list_;
  Memory& memory_;
  TraceCounts& counts_;
  Window window_;
  double list_front_ = 0.0;  // where the list begins, and a point of the tile's middle ray there
  Vec3d tile_anchor_;
  int staged_ = 0;
  // The packet's rays.
  int lanes_ = 0, width_ = 0, x0_ = 0, y0_ = 0;
  RayD axis_;                                             // through the packet's middle
  double widest_ = 0.0;                                   // upper bound of |s| below
  HWY_ALIGN Real lane_x_[kMaxLanes], lane_y_[kMaxLanes];  // pixels from (x0, y0)
  PacketRays<Real> rays_;
  // Differences from the middle ray: of direction, or of origin where the view is orthographic.
  HWY_ALIGN Real sx_[kMaxLanes], sy_[kMaxLanes], sz_[kMaxLanes];
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
