#include "metaball/reference/reference.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "metaball/local_view.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

struct Interval {
  double lo = 0.0, hi = 0.0;
};

// One metaball's density along a ray: (h - s^2)^2 with s = (t - b) / r, where that base is
// positive.
struct AlongRay {
  double b, r, h;
  double enter, exit;
  std::uint32_t idx;

  double Value(double t) const {
    const double s = (t - b) / r;
    const double q = h - s * s;
    return q > 0 ? q * q : 0.0;
  }
  // The base h - s^2 over [t0, t1].
  Interval Base(double t0, double t1) const {
    const double s0 = (t0 - b) / r, s1 = (t1 - b) / r;
    const double far = std::max(s0 * s0, s1 * s1);
    const double near = s0 <= 0 && s1 >= 0 ? 0.0 : std::min(s0 * s0, s1 * s1);
    return {std::max(0.0, h - far), std::max(0.0, h - near)};
  }
  // dF/dt = -4 q s / r over [t0, t1].
  Interval Slope(double t0, double t1) const {
    const Interval q = Base(t0, t1);
    const double s0 = (t0 - b) / r, s1 = (t1 - b) / r;
    const double corners[] = {q.lo * s0, q.lo * s1, q.hi * s0, q.hi * s1};
    const auto [lo, hi] = std::minmax_element(std::begin(corners), std::end(corners));
    return {-4 * *hi / r, -4 * *lo / r};
  }
};

class FirstCrossing {
 public:
  FirstCrossing(const std::vector<AlongRay>& along, double threshold)
      : along_(along), threshold_(threshold) {}

  // Finds the first t in [t0, t1] with F >= threshold. `active` are the metaballs that meet it.
  bool Find(double t0, double t1, const std::vector<std::uint32_t>& active, int depth) {
    std::vector<std::uint32_t> mine;
    mine.reserve(active.size());
    double smallest = INFINITY;
    for (const std::uint32_t k : active) {
      if (along_[k].enter < t1 && along_[k].exit > t0) {
        mine.push_back(k);
        smallest = std::min(smallest, along_[k].r);
      }
    }
    if (mine.empty()) return false;
    const double width = t1 - t0, middle = 0.5 * (t0 + t1);
    double natural = 0.0, at_middle = 0.0;
    Interval slope;
    for (const std::uint32_t k : mine) {
      const double q = along_[k].Base(t0, t1).hi;
      natural += q * q;
      at_middle += along_[k].Value(middle);
      const Interval d = along_[k].Slope(t0, t1);
      slope.lo += d.lo;
      slope.hi += d.hi;
    }
    const double steepest = std::max(std::abs(slope.lo), std::abs(slope.hi));
    const double upper = std::min(natural, at_middle + 0.5 * width * steepest);
    if (upper < threshold_) {
      if (upper > threshold_ * (1 - kReferenceGrazing)) grazing_ = true;
      return false;
    }
    // Rising throughout: one crossing at most, by bisection.
    if (slope.lo > 0) return Bisect(t0, t1, mine);
    if (depth >= kMaxDepth || width < 1e-9 * smallest) {
      double at_end = 0.0;
      for (const std::uint32_t k : mine) at_end += along_[k].Value(t1);
      if (at_end >= threshold_) return Bisect(t0, t1, mine);
      grazing_ = true;
      return false;
    }
    return Find(t0, middle, mine, depth + 1) || Find(middle, t1, mine, depth + 1);
  }

  double crossing() const { return crossing_; }
  bool grazing() const { return grazing_; }

 private:
  static constexpr int kMaxDepth = 200;

  double Field(double t, const std::vector<std::uint32_t>& active) const {
    double sum = 0.0;
    for (const std::uint32_t k : active) sum += along_[k].Value(t);
    return sum;
  }

  bool Bisect(double t0, double t1, const std::vector<std::uint32_t>& active) {
    if (Field(t1, active) < threshold_) {
      if (Field(t1, active) > threshold_ * (1 - kReferenceGrazing)) grazing_ = true;
      return false;
    }
    if (Field(t0, active) >= threshold_) {
      crossing_ = t0;
      return true;
    }
    for (int i = 0; i < 200; ++i) {
      const double middle = 0.5 * (t0 + t1);
      if (middle <= t0 || middle >= t1) break;
      (Field(middle, active) >= threshold_ ? t1 : t0) = middle;
    }
    crossing_ = t1;
    return true;
  }

  const std::vector<AlongRay>& along_;
  double threshold_;
  double crossing_ = 0.0;
  bool grazing_ = false;
};

ReferenceHit Shaded(const Scene& scene, const RayD& ray, double depth,
                    const std::vector<AlongRay>& along) {
  const Cloud& cloud = *scene.cloud;
  ReferenceHit hit;
  hit.hit = true;
  hit.depth = depth;
  hit.smallest_radius = INFINITY;
  const Vec3d point = ray.origin + ray.direction * depth;
  double weight = 0, strongest = 0;
  Vec3d color{}, outward{};
  for (const AlongRay& a : along) {
    const Vec3d offset = point - cloud.center[a.idx].cast<double>();
    const double q = 1 - Dot(offset, offset) / (a.r * a.r);
    if (!(q > 0)) continue;
    const double f = q * q;
    weight += f;
    color += LinearFromRgb8(cloud.ColorOf(a.idx)).cast<double>() * f;
    outward += offset * (q / (a.r * a.r));
    hit.smallest_radius = std::min(hit.smallest_radius, a.r);
    if (f > strongest) {
      strongest = f;
      hit.id = static_cast<std::int32_t>(a.idx);
    }
  }
  if (weight > 0) color = color / weight;
  hit.normal = Normalized(outward, -ray.direction);
  hit.color = color;
  const Lighting& light = scene.lighting;
  if (!light.unlit) {
    const Vec3d to_light = light.headlight ? -ray.direction : Normalized(light.to_light);
    const double factor = light.ambient + light.diffuse * std::max(0.0, Dot(hit.normal, to_light));
    hit.color = {std::min(1.0, color.x * factor), std::min(1.0, color.y * factor),
                 std::min(1.0, color.z * factor)};
  }
  return hit;
}

ReferenceHit TraceCandidates(const Scene& scene, const RayD& ray,
                             const std::vector<std::uint32_t>& candidates) {
  const Cloud& cloud = *scene.cloud;
  std::vector<AlongRay> along;
  double begin = INFINITY, end = 0;
  for (const std::uint32_t i : candidates) {
    const Vec3d to_center = cloud.center[i].cast<double>() - ray.origin;
    const double r = cloud.RadiusOf(i) * scene.surface.radius_scale;
    const double b = Dot(to_center, ray.direction);
    const Vec3d across = to_center - ray.direction * b;
    const double h = 1 - Dot(across, across) / (r * r);
    if (!(h > 0)) continue;
    const double half = std::sqrt(h) * r;
    if (!(b + half > 0)) continue;
    along.push_back({b, r, h, b - half, b + half, i});
    begin = std::min(begin, b - half);
    end = std::max(end, b + half);
  }
  if (along.empty()) return {};
  begin = std::max(begin, 0.0);

  // Pieces between the supports' ends: inside one, F is a single polynomial.
  std::vector<double> cuts{begin, end};
  for (const AlongRay& a : along) {
    if (a.enter > begin) cuts.push_back(a.enter);
    if (a.exit < end) cuts.push_back(a.exit);
  }
  std::sort(cuts.begin(), cuts.end());
  cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
  std::vector<std::uint32_t> all(along.size());
  std::iota(all.begin(), all.end(), 0u);
  FirstCrossing crossing(along, scene.surface.threshold);
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    if (crossing.Find(cuts[i], cuts[i + 1], all, 0)) {
      ReferenceHit hit = Shaded(scene, ray, crossing.crossing(), along);
      hit.grazing = crossing.grazing();
      return hit;
    }
  }
  ReferenceHit miss;
  miss.grazing = crossing.grazing();
  return miss;
}

// Metaballs that some ray of the block of pixels [x0, x1) x [y0, y1) may meet: those within the
// block's own spread of its middle ray. Rays of a perspective block leave the eye within an angle a
// of the middle one, so at distance t they are at most t sin(a) from it.
std::vector<std::uint32_t> BlockCandidates(const Scene& scene, const Camera& local, int x0, int y0,
                                           int x1, int y1) {
  const RayD axis = RayThrough(local, 0.5 * (x0 + x1), 0.5 * (y0 + y1));
  double sine = 0, shift = 0;
  for (const int x : {x0, x1}) {
    for (const int y : {y0, y1}) {
      const RayD corner = RayThrough(local, x, y);
      sine = std::max(sine, Length(Cross(corner.direction, axis.direction)));
      shift = std::max(shift, Length(corner.origin - axis.origin));
    }
  }
  const Cloud& cloud = *scene.cloud;
  std::vector<std::uint32_t> candidates;
  for (std::uint32_t i = 0; i < cloud.size(); ++i) {
    const Vec3d v = cloud.center[i].cast<double>() - axis.origin;
    const double r = cloud.RadiusOf(i) * scene.surface.radius_scale;
    const double reach = 1.000001 * (r + shift + (Length(v) + r) * sine);
    const Vec3d across = Cross(v, axis.direction);
    if (Dot(across, across) <= reach * reach) candidates.push_back(i);
  }
  return candidates;
}

}  // namespace

double ReferenceField(const Scene& scene, const Vec3d& point_in_local) {
  double sum = 0;
  for (std::size_t i = 0; i < scene.cloud->size(); ++i) {
    const Vec3d offset = point_in_local - scene.cloud->center[i].cast<double>();
    const double r = scene.cloud->RadiusOf(i) * scene.surface.radius_scale;
    const double q = 1 - Dot(offset, offset) / (r * r);
    if (q > 0) sum += q * q;
  }
  return sum;
}

ReferenceHit ReferenceTrace(const Scene& scene, const RayD& local_ray) {
  std::vector<std::uint32_t> all(scene.cloud->size());
  std::iota(all.begin(), all.end(), 0u);
  return TraceCandidates(scene, local_ray, all);
}

ReferenceFrame ReferenceRender(const Scene& scene, const Camera& camera, int threads,
                               const Control& control) {
  constexpr int kBlock = 16;
  const Camera local = LocalCamera(camera, scene.cloud->frame);
  ReferenceFrame frame;
  frame.width = camera.width;
  frame.height = camera.height;
  frame.pixels.resize(static_cast<std::size_t>(camera.width) * camera.height);
  const int columns = (camera.width + kBlock - 1) / kBlock;
  const int rows = (camera.height + kBlock - 1) / kBlock;
  ParallelFor(static_cast<std::int64_t>(columns) * rows, threads, [&](std::int64_t block, int) {
    control.ThrowIfStopped();
    const int x0 = static_cast<int>(block % columns) * kBlock;
    const int y0 = static_cast<int>(block / columns) * kBlock;
    const int x1 = std::min(x0 + kBlock, camera.width);
    const int y1 = std::min(y0 + kBlock, camera.height);
    const auto candidates = BlockCandidates(scene, local, x0, y0, x1, y1);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        frame.pixels[static_cast<std::size_t>(y) * camera.width + x] =
            TraceCandidates(scene, RayThrough(local, x + 0.5, y + 0.5), candidates);
      }
    }
  });
  return frame;
}

}  // namespace sherd
