// Packets of rays: the march of tile_march.h with a ray in every lane. One screen tile at a time,
// the widest vectors the machine has (Highway's run-time dispatch).
//
// What each lane needs to know of a metaball, its pass (density.h), is computed once a window and
// kept: the march then reads two numbers a lane and metaball each step.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "metaball/packet_tracer.cc"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "metaball/trace_job.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

constexpr int kMaxLanes = 16;
// New metaballs a window takes in. Large enough that most rays end in their first or second window,
// small enough that hidden metaballs are seldom touched.
constexpr int kWindow = 32;
// A pass far outside every segment: stands for "misses the support" and keeps b squared finite.
constexpr float kNoPass = 1e18f;

// The metaballs that form the field in the current window; one entry each.
struct Window {
  struct Entry {
    Vec3f center;  // relative to the window's reference point
    float radius, inverse_radius;
    float exit;  // upper bound of the distance at which any ray leaves it, local units
    std::uint32_t idx;
  };
  std::vector<Entry> entries;
  std::vector<float> passes;  // per entry: b of every lane, then h of every lane
};

// The rays of one packet.
struct Packet {
  int lanes = 0, width = 0;
  int x0 = 0, y0 = 0;
  RayD axis;  // through the packet's middle
  RayD ray[kMaxLanes];
  HWY_ALIGN float dx[kMaxLanes], dy[kMaxLanes], dz[kMaxLanes];
  HWY_ALIGN float ox[kMaxLanes], oy[kMaxLanes], oz[kMaxLanes];  // start minus reference point
};

void SetReference(double start, Packet* packet, SplitPoint* reference) {
  const Vec3d origin = packet->axis.origin + packet->axis.direction * start;
  *reference = SplitPoint::From(origin);
  for (int i = 0; i < packet->lanes; ++i) {
    const Vec3d offset = packet->ray[i].origin + packet->ray[i].direction * start - origin;
    packet->ox[i] = static_cast<float>(offset.x);
    packet->oy[i] = static_cast<float>(offset.y);
    packet->oz[i] = static_cast<float>(offset.z);
  }
}

// Computes the passes of one metaball; false when no searching lane meets its support.
HWY_INLINE bool ComputePass(D d, const Packet& packet, const Window::Entry& entry, M searching,
                            float* pass) {
  const V wx = hn::Set(d, entry.center.x) - hn::Load(d, packet.ox);
  const V wy = hn::Set(d, entry.center.y) - hn::Load(d, packet.oy);
  const V wz = hn::Set(d, entry.center.z) - hn::Load(d, packet.oz);
  const V dx = hn::Load(d, packet.dx), dy = hn::Load(d, packet.dy), dz = hn::Load(d, packet.dz);
  const V along = hn::MulAdd(wx, dx, hn::MulAdd(wy, dy, wz * dz));
  const V px = hn::NegMulAdd(along, dx, wx);
  const V py = hn::NegMulAdd(along, dy, wy);
  const V pz = hn::NegMulAdd(along, dz, wz);
  const V inverse_radius = hn::Set(d, entry.inverse_radius);
  const V across2 = hn::MulAdd(px, px, hn::MulAdd(py, py, pz * pz));
  const V h = hn::NegMulAdd(across2, inverse_radius * inverse_radius, hn::Set(d, 1.0f));
  const M meets = hn::And(searching, h > hn::Zero(d));
  if (hn::AllFalse(d, meets)) return false;
  hn::StoreU(hn::IfThenElse(meets, along * inverse_radius, hn::Set(d, kNoPass)), d, pass);
  hn::StoreU(h, d, pass + packet.lanes);
  return true;
}

struct Bound {
  V c0, c1, c2, c3, c4;
};

// FieldBound::Add over the window, in every lane on its own segment [t, t + dt].
HWY_INLINE Bound BoundField(D d, const Window& window, int lanes, V t, V dt) {
  const V zero = hn::Zero(d);
  V c0 = zero, c1 = zero, c2a = zero, c2b = zero, c3 = zero, c4 = zero;
  const float* pass = window.passes.data();
  for (const Window::Entry& entry : window.entries) {
    const V inverse_radius = hn::Set(d, entry.inverse_radius);
    const V h = hn::LoadU(d, pass + lanes);
    const V s0 = hn::MulSub(t, inverse_radius, hn::LoadU(d, pass));
    const V s1 = hn::MulAdd(dt, inverse_radius, s0);
    const V q0 = hn::Max(hn::NegMulAdd(s0, s0, h), zero);
    const V q1 = hn::Max(hn::NegMulAdd(s0, s1, h), zero);
    const V q2 = hn::Max(hn::NegMulAdd(s1, s1, h), zero);
    c0 = hn::MulAdd(q0, q0, c0);
    c1 = hn::MulAdd(q0, q1, c1);
    c2a = hn::MulAdd(q0, q2, c2a);
    c2b = hn::MulAdd(q1, q1, c2b);
    c3 = hn::MulAdd(q1, q2, c3);
    c4 = hn::MulAdd(q2, q2, c4);
    pass += 2 * lanes;
  }
  const V c2 = hn::MulAdd(c2b, hn::Set(d, 2.0f), c2a) * hn::Set(d, 1.0f / 3.0f);
  return {c0, c1, c2, c3, c4};
}

// The state of first_crossing.h's March in every lane.
struct Lanes {
  V t, dt;
  M searching, hit;
  std::uint32_t grazing = 0;
};

// AdvanceMarch, lane by lane.
HWY_INLINE void AdvanceLanes(D d, const Bound& bound, V threshold, V tolerance, V t_end,
                             Lanes* lanes) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
  const V t = lanes->t, dt = lanes->dt;
  const M at_start = bound.c0 >= threshold;
  const V slope1 = (bound.c1 - bound.c0) * hn::Set(d, 4.0f);
  const V slope2 = (bound.c2 - bound.c0) * two;
  const V slope3 = (bound.c3 - bound.c0) * hn::Set(d, 4.0f / 3.0f);
  const V slope4 = bound.c4 - bound.c0;
  const V steepest = hn::Max(hn::Max(slope1, slope2), hn::Max(slope3, slope4));
  const V rise = threshold - bound.c0;
  const M blocked = steepest >= rise;
  const M certain = bound.c4 >= threshold;
  const V u = hn::IfThenElse(blocked, rise / hn::IfThenElse(blocked, steepest, one), one);
  const V room = one - u;
  const M accepted = hn::And(hn::And(blocked, certain), room * dt <= tolerance);
  const M open = hn::AndNot(accepted, blocked);
  const M grazing = hn::And(open, dt <= tolerance);
  const M refine = hn::AndNot(grazing, open);

  // Newton's step on the bound at u (EvaluateBound).
  V p0 = hn::MulAdd(u, bound.c1 - bound.c0, bound.c0);
  V p1 = hn::MulAdd(u, bound.c2 - bound.c1, bound.c1);
  V p2 = hn::MulAdd(u, bound.c3 - bound.c2, bound.c2);
  V p3 = hn::MulAdd(u, bound.c4 - bound.c3, bound.c3);
  p0 = hn::MulAdd(u, p1 - p0, p0);
  p1 = hn::MulAdd(u, p2 - p1, p1);
  p2 = hn::MulAdd(u, p3 - p2, p2);
  p0 = hn::MulAdd(u, p1 - p0, p0);
  p1 = hn::MulAdd(u, p2 - p1, p1);
  const V slope = (p1 - p0) * hn::Set(d, 4.0f);
  const V gap = threshold - hn::MulAdd(u, p1 - p0, p0);
  const M rising = slope > zero;
  V reach = hn::IfThenElse(rising, gap / hn::IfThenElse(rising, slope, one), one);
  reach = hn::Max(hn::Min(reach, room), zero);

  const V secant = rise / hn::IfThenElse(accepted, bound.c4 - bound.c0, one);
  const V step = hn::IfThenElse(accepted, hn::Max(secant, u), hn::IfThenElse(refine, u, one));
  const V refined_dt =
      hn::Min(hn::MulAdd(reach * dt, hn::Set(d, 1.125f), tolerance * hn::Set(d, 0.5f)),
              dt * hn::Set(d, static_cast<float>(kRefineShrink)));
  const V next_t = hn::IfThenElse(at_start, t, hn::MulAdd(step, dt, t));
  const M found = hn::And(lanes->searching, hn::Or(at_start, accepted));
  lanes->t = hn::IfThenElse(lanes->searching, next_t, t);
  lanes->hit = hn::Or(lanes->hit, found);
  lanes->searching = hn::AndNot(found, lanes->searching);
  lanes->grazing +=
      static_cast<std::uint32_t>(hn::CountTrue(d, hn::And(grazing, lanes->searching)));
  const V rest = t_end - lanes->t;
  lanes->searching = hn::And(lanes->searching, rest > zero);
  lanes->dt = hn::Min(hn::IfThenElse(refine, refined_dt, dt * two), rest);
}

// Sums of shading.h's SurfaceSums in every lane, then lane by lane into the frame.
void ShadeHits(D d, const TraceJob& job, const Packet& packet, const Window& window, V t, M hit,
               double start) {
  const int lanes = packet.lanes;
  const float* table = SrgbToLinearTable();
  const Cloud& cloud = *job.cloud;
  const bool want_id = !job.frame->id.empty();
  const V dx = hn::Load(d, packet.dx), dy = hn::Load(d, packet.dy), dz = hn::Load(d, packet.dz);
  const V x = hn::MulAdd(t, dx, hn::Load(d, packet.ox));
  const V y = hn::MulAdd(t, dy, hn::Load(d, packet.oy));
  const V z = hn::MulAdd(t, dz, hn::Load(d, packet.oz));
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  V weight = zero, r = zero, g = zero, b = zero, nx = zero, ny = zero, nz = zero;
  V strongest = zero;
  const hn::RebindToSigned<D> di;
  auto strongest_idx = hn::Set(di, -1);
  for (const Window::Entry& entry : window.entries) {
    const V inverse_r2 = hn::Set(d, entry.inverse_radius * entry.inverse_radius);
    const V ex = x - hn::Set(d, entry.center.x);
    const V ey = y - hn::Set(d, entry.center.y);
    const V ez = z - hn::Set(d, entry.center.z);
    const V distance2 = hn::MulAdd(ex, ex, hn::MulAdd(ey, ey, ez * ez));
    const V q = hn::Max(hn::NegMulAdd(distance2, inverse_r2, one), zero);
    const V f = q * q;
    if (hn::AllTrue(d, f == zero)) continue;
    const Rgb8 color = cloud.color.empty() ? cloud.uniform_color : cloud.color[entry.idx];
    weight = weight + f;
    r = hn::MulAdd(f, hn::Set(d, table[color.r]), r);
    g = hn::MulAdd(f, hn::Set(d, table[color.g]), g);
    b = hn::MulAdd(f, hn::Set(d, table[color.b]), b);
    const V k = q * inverse_r2;
    nx = hn::MulAdd(k, ex, nx);
    ny = hn::MulAdd(k, ey, ny);
    nz = hn::MulAdd(k, ez, nz);
    if (want_id) {
      const M stronger = f > strongest;
      strongest = hn::IfThenElse(stronger, f, strongest);
      strongest_idx =
          hn::IfThenElse(hn::RebindMask(di, stronger),
                         hn::Set(di, static_cast<std::int32_t>(entry.idx)), strongest_idx);
    }
  }
  const V inverse_weight = one / hn::IfThenElse(weight > zero, weight, one);
  HWY_ALIGN float value[7][kMaxLanes];
  HWY_ALIGN std::int32_t id[kMaxLanes];
  HWY_ALIGN std::int32_t is_hit[kMaxLanes];
  hn::Store(r * inverse_weight, d, value[0]);
  hn::Store(g * inverse_weight, d, value[1]);
  hn::Store(b * inverse_weight, d, value[2]);
  hn::Store(nx, d, value[3]);
  hn::Store(ny, d, value[4]);
  hn::Store(nz, d, value[5]);
  hn::Store(t, d, value[6]);
  hn::Store(strongest_idx, di, id);
  hn::Store(hn::IfThenElseZero(hn::RebindMask(di, hit), hn::Set(di, 1)), di, is_hit);
  Frame& frame = *job.frame;
  for (int i = 0; i < lanes; ++i) {
    if (!is_hit[i]) continue;
    const Vec3f to_viewer{-packet.dx[i], -packet.dy[i], -packet.dz[i]};
    const Vec3f normal = Normalized(Vec3f{value[3][i], value[4][i], value[5][i]}, to_viewer);
    const Vec3f c =
        Shade(job.light, Vec3f{value[0][i], value[1][i], value[2][i]}, normal, to_viewer);
    const std::size_t pixel = static_cast<std::size_t>(packet.y0 + i / packet.width) * frame.width +
                              packet.x0 + i % packet.width;
    frame.color[pixel] = {c.x, c.y, c.z, 1.0f};
    if (!frame.depth.empty()) {
      frame.depth[pixel] =
          WorldDepth(start + static_cast<double>(value[6][i]), job.cloud->frame.unit);
    }
    if (!frame.normal.empty()) frame.normal[pixel] = normal;
    if (want_id) frame.id[pixel] = id[i];
  }
}

// Moves the window on: drops what lies behind `start`, takes in the next metaballs of the list, and
// computes every pass anew. Returns the position in the list of the first metaball not taken in.
int FillWindow(D d, const TileList& list, const Packet& packet, const SplitPoint& reference,
               double start, int next, M searching, Window* window) {
  const int stride = 2 * packet.lanes;
  std::size_t kept = 0;
  const auto add = [&](std::uint32_t idx) HWY_ATTR {
    Window::Entry entry;
    entry.idx = idx;
    entry.center = Minus(list.center[idx], reference);
    entry.radius = list.RadiusOf(idx);
    entry.inverse_radius = 1.0f / entry.radius;
    // The front errs by at most 1e-6 of the distance, which the factor covers twice.
    const float front = list.front[idx];
    entry.exit = front + 2.0f * entry.radius + 4e-6f * (std::abs(front) + entry.radius);
    if (window->passes.size() < (kept + 1) * stride) window->passes.resize((kept + 1) * 2 * stride);
    if (!ComputePass(d, packet, entry, searching, window->passes.data() + kept * stride)) return;
    if (kept == window->entries.size()) {
      window->entries.push_back(entry);
    } else {
      window->entries[kept] = entry;
    }
    ++kept;
  };
  const std::size_t carried = window->entries.size();
  for (std::size_t k = 0; k < carried; ++k) {
    if (window->entries[k].exit > start) add(window->entries[k].idx);
  }
  window->entries.resize(kept);
  const std::size_t wanted = kept + kWindow;
  while (next < list.count && (kept < wanted || list.front[list.metaball[next]] <= start)) {
    add(list.metaball[next++]);
  }
  return next;
}

void TracePacket(const TraceJob& job, const TileList& list, Packet* packet, M active,
                 Window* window, TraceCounts* counts) {
  const D d;
  window->entries.clear();
  double start = std::max(0.0f, list.front[list.metaball[0]]);
  const V threshold = hn::Set(d, job.threshold);
  M searching = active;
  int next = 0;
  while (!hn::AllFalse(d, searching)) {
    SplitPoint reference;
    SetReference(start, packet, &reference);
    next = FillWindow(d, list, *packet, reference, start, next, searching, window);
    const bool last = next == list.count;
    const double end = last ? 0.0 : static_cast<double>(list.front[list.metaball[next]]);
    if (window->entries.empty()) {
      if (last) return;
      start = end;
      continue;
    }
    float smallest = INFINITY, last_exit = -INFINITY;
    for (const Window::Entry& entry : window->entries) {
      smallest = std::min(smallest, entry.radius);
      last_exit = std::max(last_exit, entry.exit);
    }
    const double room = static_cast<double>(last_exit) - start;
    const auto t_end = static_cast<float>(last ? room : std::min(room, end - start));
    if (t_end > 0.0f) {
      Lanes lanes;
      lanes.t = hn::Zero(d);
      lanes.dt = hn::Set(d, std::min(0.5f * smallest, t_end));
      lanes.searching = searching;
      lanes.hit = hn::MaskFromVec(hn::Zero(d));
      const V tolerance = hn::Set(d, std::max(kDepthTolerance * smallest, 4e-7f * t_end));
      const V limit = hn::Set(d, t_end);
      int steps = 0;
      while (!hn::AllFalse(d, lanes.searching)) {
        if (++steps > kMaxStepsPerWindow) {
          counts->rays.unresolved += hn::CountTrue(d, lanes.searching);
          break;
        }
        const Bound bound = BoundField(d, *window, packet->lanes, lanes.t, lanes.dt);
        AdvanceLanes(d, bound, threshold, tolerance, limit, &lanes);
      }
      counts->rays.grazing += lanes.grazing;
      if (!hn::AllFalse(d, lanes.hit)) {
        counts->hits += hn::CountTrue(d, lanes.hit);
        if (!(start > 0.0)) {
          counts->rays.started_inside +=
              hn::CountTrue(d, hn::And(lanes.hit, lanes.t <= hn::Zero(d)));
        }
        ShadeHits(d, job, *packet, *window, lanes.t, lanes.hit, start);
        searching = hn::AndNot(lanes.hit, searching);
      }
    }
    if (last) return;
    start = std::max(start, end);
  }
}

}  // namespace

void TraceTile(const TraceJob& job, int tile, TraceCounts* counts) {
  const D d;
  // Kept between tiles; a worker thread traces one tile at a time.
  static thread_local Window window;
  const TileList list = job.ListOf(tile);
  const Frame& frame = *job.frame;
  const int x0 = tile % job.bins->tiles_x() * kTileSize;
  const int y0 = tile / job.bins->tiles_x() * kTileSize;
  Packet packet;
  packet.lanes = static_cast<int>(hn::Lanes(d));
  packet.width = packet.lanes >= 8 ? 4 : packet.lanes >= 4 ? 2 : 1;
  const int height = packet.lanes / packet.width;
  for (int y = y0; y < std::min(y0 + kTileSize, frame.height); y += height) {
    for (int x = x0; x < std::min(x0 + kTileSize, frame.width); x += packet.width) {
      packet.x0 = x;
      packet.y0 = y;
      packet.axis = RayThrough(job.camera, x + 0.5 * packet.width, y + 0.5 * height);
      HWY_ALIGN float inside[kMaxLanes];
      for (int i = 0; i < packet.lanes; ++i) {
        const int px = x + i % packet.width, py = y + i / packet.width;
        inside[i] = px < frame.width && py < frame.height ? 1.0f : 0.0f;
        packet.ray[i] = RayThrough(job.camera, px + 0.5, py + 0.5);
        packet.dx[i] = static_cast<float>(packet.ray[i].direction.x);
        packet.dy[i] = static_cast<float>(packet.ray[i].direction.y);
        packet.dz[i] = static_cast<float>(packet.ray[i].direction.z);
      }
      TracePacket(job, list, &packet, hn::Load(d, inside) > hn::Zero(d), &window, counts);
    }
  }
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sherd {
namespace {

HWY_EXPORT(TraceTile);
HWY_EXPORT(TargetName);

}  // namespace

void TraceTilePackets(const TraceJob& job, int tile, TraceCounts* counts) {
  HWY_DYNAMIC_DISPATCH(TraceTile)(job, tile, counts);
}

std::string PacketTargetName() {
  const std::string name = HWY_DYNAMIC_DISPATCH(TargetName)();
  return name.starts_with("AVX3") ? "AVX-512" : name;  // Highway's name for it
}

}  // namespace sherd
#endif  // HWY_ONCE
