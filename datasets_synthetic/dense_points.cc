#include <algorithm>
#include <cmath>

#include "datasets_synthetic/photograph.h"
#include "datasets_synthetic/random.h"
#include "datasets_synthetic/survey_points.h"
#include "datasets_synthetic/visibility.h"
#include "metaball/parallel.h"

namespace sherd::synthetic {
namespace {

constexpr std::size_t kMinViews = 3;
constexpr double kNormalNoise = 0.05;  // radians, each axis, where there is noise at all
constexpr float kColorNoise = 3.0f;    // 8-bit levels

Rgb8 NoisyColor(const Vec3f& srgb, double noise_levels, Rng* rng) {
  const auto channel = [&](float v) {
    return Quantize8(v + static_cast<float>(noise_levels * rng->Gaussian()) / 255.0f);
  };
  const std::uint8_t r = channel(srgb.x), g = channel(srgb.y);
  return {r, g, channel(srgb.z)};
}

class DenseSampler {
 public:
  DenseSampler(const TrenchScene& scene, const ShotPlan& plan, const std::vector<Lens>& pinholes,
               const std::vector<std::size_t>& image_order, const ExcavationOptions& options)
      : scene_(scene), plan_(plan), pinholes_(pinholes), options_(options) {
    image_idx_of_shot_.resize(plan.shots.size());
    for (std::size_t i = 0; i < image_order.size(); ++i) {
      image_idx_of_shot_[image_order[i]] = static_cast<std::uint32_t>(i);
    }
  }

  // A point that the fusion of depth maps would leave, from a random pixel of a photograph; false
  // where it would not: nothing there, too few views, or another photograph shows it better.
  bool Sample(std::uint64_t number, FusedPoint* out) const {
    Rng rng(HashOf(options_.seed, 110, number));
    const std::size_t shot_idx = number % plan_.shots.size();
    const Shot& shot = plan_.shots[shot_idx];
    const Lens& lens = pinholes_[shot.lens_idx];
    const double x = rng.Uniform(0, lens.width), y = rng.Uniform(0, lens.height);
    double u, v;
    lens.Unproject(x, y, &u, &v);
    SceneHit hit;
    if (!scene_.Intersect(shot.RayOf(u, v), &hit) || !InSurveyArea(hit.point)) return false;
    const std::vector<Sighting> seen =
        FindSightings(scene_, plan_, pinholes_, hit.point, hit.normal, 1.0);
    if (seen.size() < kMinViews) return false;
    // All photographs together would put sum(density) points here; fusion merges them into about
    // as many as the best one has pixels.
    double sum = 0, best = 0;
    bool own = false;
    for (const Sighting& s : seen) {
      const double density = s.pixels_per_metre * s.pixels_per_metre;
      sum += density;
      best = std::max(best, density);
      own |= s.shot_idx == shot_idx;
    }
    if (!own || rng.Uniform() * sum > best) return false;

    const double footprint = hit.mesh.distance / lens.fx;
    const Vec3f srgb = Develop(scene_.Radiance(hit, footprint), shot.exposure);
    Vec3d p = hit.point, normal = hit.normal;
    if (options_.colmap_half_pixel) p = HalfPixelOff(shot, lens, p);
    if (options_.noise_m > 0) {
      const Vec3d error{rng.Gaussian(), rng.Gaussian(), rng.Gaussian()};
      p += error * options_.noise_m;
      const Vec3d tip{rng.Gaussian(), rng.Gaussian(), rng.Gaussian()};
      normal = Normalized(normal + tip * kNormalNoise);
    }
    out->position = p.cast<float>();
    out->normal = normal.cast<float>();
    out->color = NoisyColor(srgb, options_.noise_m > 0 ? kColorNoise : 0.0, &rng);
    for (const Sighting& s : seen) out->image_idx.push_back(image_idx_of_shot_[s.shot_idx]);
    std::sort(out->image_idx.begin(), out->image_idx.end());
    return true;
  }

  // A stray point somewhere in the survey area, claimed by a few photographs whose field it is in.
  FusedPoint Outlier(std::uint64_t number) const {
    Rng rng(HashOf(options_.seed, 111, number));
    FusedPoint out;
    for (;;) {
      const Vec3d p{rng.Uniform(kSurveyLow.x, kSurveyHigh.x),
                    rng.Uniform(kSurveyLow.y, kSurveyHigh.y),
                    rng.Uniform(kSurveyLow.z, kSurveyHigh.z)};
      std::vector<std::uint32_t> views;
      for (std::size_t i = 0; i < plan_.shots.size(); ++i) {
        const Shot& shot = plan_.shots[i];
        const Lens& lens = pinholes_[shot.lens_idx];
        const Vec3d c = shot.ToCamera(p);
        double x = 0, y = 0;
        if (c.z > 0.1 && lens.Project(c.x / c.z, c.y / c.z, &x, &y) && x >= 1 &&
            x <= lens.width - 1 && y >= 1 && y <= lens.height - 1) {
          views.push_back(image_idx_of_shot_[i]);
        }
      }
      if (views.empty()) continue;
      while (views.size() > kMinViews) {
        views.erase(views.begin() + rng.Index(static_cast<int>(views.size())));
      }
      std::sort(views.begin(), views.end());
      out.position = p.cast<float>();
      out.image_idx = std::move(views);
      break;
    }
    const Vec3d n{rng.Gaussian(), rng.Gaussian(), rng.Gaussian()};
    out.normal = Normalized(n).cast<float>();
    const float tone = static_cast<float>(rng.Uniform(0.15, 0.8));
    out.color = NoisyColor({tone, tone * 0.88f, tone * 0.72f}, 12.0, &rng);
    return out;
  }

 private:
  // Where COLMAP's fusion puts the point: half a pixel of the depth map up and to the left.
  Vec3d HalfPixelOff(const Shot& shot, const Lens& lens, const Vec3d& p) const {
    const Lens map = DepthMapCamera(lens, options_.depth_map_max_side);
    const double depth = shot.ToCamera(p).z;
    return p - shot.right * (0.5 * depth / map.fx) - shot.down * (0.5 * depth / map.fy);
  }

  const TrenchScene& scene_;
  const ShotPlan& plan_;
  const std::vector<Lens>& pinholes_;
  const ExcavationOptions& options_;
  std::vector<std::uint32_t> image_idx_of_shot_;
};

}  // namespace

Lens DepthMapCamera(const Lens& pinhole, int max_side) {
  const double scale =
      std::min(1.0, static_cast<double>(max_side) / std::max(pinhole.width, pinhole.height));
  const auto side = [scale](int size) {
    return std::max(1, static_cast<int>(std::lround(size * scale)));
  };
  return ResizedLens(pinhole, side(pinhole.width), side(pinhole.height));
}

std::vector<FusedPoint> MakeDenseCloud(const TrenchScene& scene, const ShotPlan& plan,
                                       const std::vector<Lens>& pinholes,
                                       const std::vector<std::size_t>& image_order,
                                       const ExcavationOptions& options, const Control& control) {
  const DenseSampler sampler(scene, plan, pinholes, image_order, options);
  const auto outliers = static_cast<std::size_t>(
      std::llround(static_cast<double>(options.dense_points) * options.outlier_share));
  const std::size_t wanted = options.dense_points - outliers;
  std::vector<FusedPoint> points;
  points.reserve(options.dense_points);
  // Fixed batches, so that the cloud does not depend on the number of threads.
  constexpr std::int64_t kBatch = 1 << 17, kBlock = 512;
  std::uint64_t first = 0;
  while (points.size() < wanted) {
    std::vector<FusedPoint> batch(kBatch);
    std::vector<std::uint8_t> found(kBatch);
    ParallelFor(kBatch / kBlock, options.threads, [&](std::int64_t block, int) {
      control.ThrowIfStopped();
      for (std::int64_t i = block * kBlock; i < (block + 1) * kBlock; ++i) {
        const auto at = static_cast<std::size_t>(i);
        found[at] = sampler.Sample(first + at, &batch[at]);
      }
    });
    const std::size_t before = points.size();
    for (std::size_t i = 0; i < batch.size() && points.size() < wanted; ++i) {
      if (found[i]) points.push_back(std::move(batch[i]));
    }
    first += kBatch;
    control.Report("dense points",
                   static_cast<double>(points.size()) / static_cast<double>(options.dense_points));
    // No photograph shows anything three times (a handful of photographs that look elsewhere).
    if (points.size() == before) break;
  }
  // Strewn among the others, as in a real cloud.
  const std::size_t surface = points.size();
  for (std::size_t k = 0; k < outliers; ++k) {
    FusedPoint outlier = sampler.Outlier(k);
    const auto at = static_cast<std::size_t>(UnitOf(HashOf(options.seed, 112, k)) *
                                             static_cast<double>(surface));
    if (at < surface) {
      std::swap(points[at], outlier);
    }
    points.push_back(std::move(outlier));
  }
  return points;
}

DepthMap MakeDepthMap(const TrenchScene& scene, const Shot& shot, const Lens& camera, int threads,
                      const Control& control) {
  DepthMap map;
  map.width = camera.width;
  map.height = camera.height;
  const std::size_t plane =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  map.depth.assign(plane, 0.0f);
  map.normal.assign(3 * plane, 0.0f);
  ParallelFor(camera.height, threads, [&](std::int64_t y, int) {
    control.ThrowIfStopped();
    for (int x = 0; x < camera.width; ++x) {
      double u, v;
      camera.Unproject(x + 0.5, static_cast<double>(y) + 0.5, &u, &v);
      SceneHit hit;
      if (!scene.Intersect(shot.RayOf(u, v), &hit)) continue;
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                            static_cast<std::size_t>(x);
      map.depth[i] = static_cast<float>(shot.ToCamera(hit.point).z);
      map.normal[i] = static_cast<float>(Dot(hit.normal, shot.right));
      map.normal[plane + i] = static_cast<float>(Dot(hit.normal, shot.down));
      map.normal[2 * plane + i] = static_cast<float>(Dot(hit.normal, shot.forward));
    }
  });
  return map;
}

}  // namespace sherd::synthetic
