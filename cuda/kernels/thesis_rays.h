// The thesis's search (metaball/thesis/thesis_search.h), one ray a thread.
//
// Threads are dealt out to pixels in squares, so that the rays of a warp meet the same nodes. What
// a ray's node takes lies in the thread's own memory. Spheres, thresholds and colours lie in the
// order of the octree's lists: those of a node are read one after another.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "cuda/kernels/binning.h"
#include "cuda/kernels/device_ops.h"
#include "cuda/kernels/packed_color.h"
#include "metaball/camera.h"
#include "metaball/density/scalar_math.h"
#include "metaball/frame.h"
#include "metaball/methods/hit_pixel.h"
#include "metaball/shading.h"
#include "metaball/thesis/thesis_search.h"

namespace sherd::kernels {

// What the kernel is compiled for.
template <class RealT, class ShapeT, bool kOwnV>
struct ThesisTraits {
  using Real = RealT;                  // float or double
  using Shape = ShapeT;                // of the density (metaball/density/shapes.h)
  static constexpr bool kOwn = kOwnV;  // radii or thresholds differ
};

// The metaballs that a ray's node takes into the thread's memory.
inline constexpr std::uint32_t kThesisRoom = 64;

template <class Taken>
struct ThesisStore {
  static constexpr std::uint32_t kRoom = kThesisRoom;
  Taken taken[kRoom];

  SHERD_HD void Set(std::uint32_t k, const Taken& value) { taken[k] = value; }
  SHERD_HD const Taken& operator[](std::uint32_t k) const { return taken[k]; }
};

// The scene's metaballs in the order of the octree's lists.
struct ListedArrays {
  const Sphere* sphere = nullptr;           // radius_scale not yet applied
  const float* threshold = nullptr;         // null: the surface's
  const std::uint32_t* order = nullptr;     // indices into the cloud
  const std::uint32_t* color = nullptr;     // PackColor; null: uniform_color
  const float* linear_from_srgb = nullptr;  // 256 values
  Vec3f uniform_color{};                    // linear
};

template <bool kOwnV>
struct ListedMetaballs : ListedArrays {
  static constexpr bool kOwn = kOwnV;

  SHERD_HD Sphere Read(std::uint32_t place) const { return sphere[place]; }
  SHERD_HD std::uint32_t IndexOf(std::uint32_t place) const { return order[place]; }
  template <class Real>
  SHERD_HD Real ThresholdOf(std::uint32_t place, Real otherwise) const {
    return threshold ? static_cast<Real>(threshold[place]) : otherwise;
  }
  SHERD_HD Vec3f LinearColorOf(std::uint32_t place) const {
    return color ? UnpackColor(color[place], linear_from_srgb) : uniform_color;
  }
};

// Sums over a frame, spread over several so that threads seldom meet at one.
struct ThesisCounts {
  std::uint32_t hits, started_inside, unresolved;
};
inline constexpr int kThesisCounts = 256;

// The whole picture's camera, eye and orthographic scale in local units, and what divides by its
// focal lengths without a division.
struct ThesisCamera {
  Camera camera;
  double inverse_fx = 1.0, inverse_fy = 1.0;
};

// A ray in the numbers it is traced with: at depth `base` along it lies `origin`.
template <class Real>
struct ThesisRay {
  Vec3<Real> origin, direction;
  double base = 0.0;
};

SHERD_HD ThesisRay<double> AimThesisRay(const ThesisCamera& view, const OctreeView<double>&,
                                        double x, double y) {
  const RayD ray = RayThrough(view.camera, x, y);
  return {ray.origin, ray.direction, 0.0};
}

// Floats cannot hold a distant camera: the ray is moved up to the sphere around the octree's cube,
// in doubles, of which few are slow ones (no division, no root).
SHERD_HD ThesisRay<float> AimThesisRay(const ThesisCamera& view, const OctreeView<float>& octree,
                                       double x, double y) {
  const Camera& camera = view.camera;
  const Vec3d offset = camera.right * ((x - camera.cx) * view.inverse_fx) +
                       camera.down * ((y - camera.cy) * view.inverse_fy);
  const bool perspective = camera.projection == Projection::kPerspective;
  const Vec3d eye = perspective ? camera.eye : camera.eye + offset;
  const Vec3d along = perspective ? camera.forward + offset : camera.forward;
  const float length2 = Dot(along.cast<float>(), along.cast<float>());
  // One step of Newton's from the float to the double.
  const double first = static_cast<double>(1.0f / sqrtf(length2));
  const double inverse = first * (1.5 - 0.5 * Dot(along, along) * first * first);
  const Vec3d direction = along * inverse;
  const float half = 0.5f * octree.size;
  const Vec3f middle = octree.corner + Vec3f{half, half, half};
  const float to_middle = Dot(middle - eye.cast<float>(), direction.cast<float>());
  constexpr float kCircumscribed = 1.74f;  // over the half side: more than the root of 3
  const float base = Max(0.0f, to_middle * (1.0f - 1e-6f) - kCircumscribed * half);
  ThesisRay<float> ray;
  ray.base = static_cast<double>(base);
  ray.origin = (eye + direction * ray.base).cast<float>();
  ray.direction = direction.cast<float>();
  return ray;
}

// The kernel. Local units.
template <class Traits>
struct ThesisRays {
  // Small blocks: rays take different times, and a block waits for its last. The second number
  // leaves a thread as many registers as the search wants (cuda/kernel_report.sh shows spills).
  static constexpr int kThreads = 128;
  static constexpr int kBlocksPerMultiprocessor = sizeof(typename Traits::Real) == 8 ? 4 : 7;
  static constexpr std::uint64_t kThreadsAtOnce = std::uint64_t{1} << 20;

  using Real = typename Traits::Real;
  using Metaballs = ListedMetaballs<Traits::kOwn>;
  using Store = ThesisStore<ThesisTaken<Real, Traits::kOwn>>;

  ThesisCamera view;
  int first_row = 0, rows = 0;  // of the picture that are drawn
  OctreeView<Real> octree;
  Metaballs metaballs;
  ThesisDensity<Real, typename Traits::Shape> density;
  ThesisRules<Real> rules;
  FrameLight light;
  double world_per_local = 1.0;
  // Planes of the rows, of the camera's width; all but colour may be null.
  Pixel* out_color = nullptr;
  float* out_depth = nullptr;
  Vec3f* out_normal = nullptr;
  std::int32_t* out_id = nullptr;
  ThesisCounts* counts = nullptr;  // kThesisCounts

  static constexpr int kSide = 8;  // of a square of rays
  SHERD_HD static std::uint64_t Across(int pixels) {
    return static_cast<std::uint64_t>((pixels + kSide - 1) / kSide);
  }
  // Threads for as many rows of a picture.
  SHERD_HD static std::uint64_t Threads(int width, int rows) {
    return Across(width) * Across(rows) * kSide * kSide;
  }

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::uint64_t square = thread / (kSide * kSide);
    const int within = static_cast<int>(thread % (kSide * kSide));
    const std::uint64_t columns = Across(view.camera.width);
    const int x = static_cast<int>(square % columns) * kSide + within % kSide;
    const int y = static_cast<int>(square / columns) * kSide + within / kSide;
    if (x >= view.camera.width || y >= rows) return;
    const ThesisRay<Real> ray = AimThesisRay(view, octree, x + 0.5, first_row + y + 0.5);
    Store store;
    ThesisSearch<Real, typename Traits::Shape, Metaballs, Store> search(octree, metaballs, density,
                                                                        rules, &store);
    RayCounts rare;
    const Real depth = search.Trace(ray.origin, ray.direction, &rare);
    const bool hit = depth >= Real(0);
    LitHit lit{};
    float world_depth = 0.0f;
    std::int32_t id = -1;
    ThesisCounts& sums = counts[square % kThesisCounts];
    if (hit) {
      const BasicHitSums<Real> gathered = search.Gather(depth);
      const double local_depth = ray.base + static_cast<double>(depth);
      lit = LightHit(light, ray.direction, gathered);
      world_depth = WorldDepth(local_depth, world_per_local);
      id = gathered.strongest_idx;
      AtomicAdd(&sums.hits, 1);
      if (!(local_depth > 0.0)) AtomicAdd(&sums.started_inside, 1);
    }
    if (rare.unresolved != 0) AtomicAdd(&sums.unresolved, 1);
    const std::size_t at = static_cast<std::size_t>(y) * view.camera.width + x;
    out_color[at] = lit.color;
    if (out_depth) out_depth[at] = world_depth;
    if (out_normal) out_normal[at] = lit.normal;
    if (out_id) out_id[at] = id;
  }
};

}  // namespace sherd::kernels
