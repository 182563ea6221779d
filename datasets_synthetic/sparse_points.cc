#include <algorithm>
#include <cmath>
#include <map>

#include "datasets_synthetic/photograph.h"
#include "datasets_synthetic/random.h"
#include "datasets_synthetic/survey_points.h"
#include "datasets_synthetic/visibility.h"
#include "metaball/parallel.h"

namespace sherd::synthetic {
namespace {

constexpr double kMargin = 3.0;  // px from the border of the photograph
constexpr std::size_t kMinTrack = 3;
constexpr double kDetected = 0.62;        // chance that a photograph that sees a point has it
constexpr double kUnmatchedShare = 0.35;  // of an image's keypoints belong to no point

struct Candidate {
  bool found = false;
  Vec3d position{};
  Rgb8 color;
  std::vector<Sighting> track;  // with noise
};

Candidate MakeCandidate(const TrenchScene& scene, const ShotPlan& plan,
                        const ExcavationOptions& options, std::uint64_t number) {
  Rng rng(HashOf(options.seed, 100, number));
  Candidate c;
  const Shot& shot = plan.shots[number % plan.shots.size()];
  const Lens& lens = plan.lenses[shot.lens_idx];
  const double x = rng.Uniform(kMargin, lens.width - kMargin);
  const double y = rng.Uniform(kMargin, lens.height - kMargin);
  double u, v;
  lens.Unproject(x, y, &u, &v);
  SceneHit hit;
  if (!scene.Intersect(shot.RayOf(u, v), &hit)) return c;
  // Features far out on the turf are rarely matched.
  if (!InSurveyArea(hit.point) && rng.Uniform() < 0.85) return c;
  std::vector<Sighting> seen =
      FindSightings(scene, plan, plan.lenses, hit.point, hit.normal, kMargin);
  if (seen.size() < kMinTrack) return c;
  // Some photographs miss it, as a detector does; three keep it.
  while (seen.size() > kMinTrack) {
    const auto missed = static_cast<std::size_t>(rng.Index(static_cast<int>(seen.size())));
    if (rng.Uniform() < kDetected) break;
    seen.erase(seen.begin() + static_cast<std::ptrdiff_t>(missed));
  }
  for (Sighting& s : seen) {
    s.x += options.keypoint_noise_px * rng.Gaussian();
    s.y += options.keypoint_noise_px * rng.Gaussian();
  }
  c.found = true;
  c.position = hit.point;
  const Vec3f srgb = Develop(scene.Radiance(hit, 2.0 * hit.mesh.distance / lens.fx), 1.0f);
  c.color = {Quantize8(srgb.x), Quantize8(srgb.y), Quantize8(srgb.z)};
  c.track = std::move(seen);
  return c;
}

}  // namespace

SparseModel MakeSparseModel(const TrenchScene& scene, const ShotPlan& plan,
                            const ExcavationOptions& options, const Control& control) {
  // Candidates in fixed batches, until there are enough or the photographs show no more.
  std::vector<Candidate> points;
  constexpr std::int64_t kBatch = 8192;
  const std::uint64_t most = options.sparse_points * 12 + kBatch;
  for (std::uint64_t first = 0; points.size() < options.sparse_points && first < most;
       first += kBatch) {
    std::vector<Candidate> batch(kBatch);
    ParallelFor(kBatch / 64, options.threads, [&](std::int64_t block, int) {
      control.ThrowIfStopped();
      for (std::int64_t i = block * 64; i < (block + 1) * 64; ++i) {
        batch[static_cast<std::size_t>(i)] =
            MakeCandidate(scene, plan, options, first + static_cast<std::uint64_t>(i));
      }
    });
    for (Candidate& c : batch) {
      if (c.found && points.size() < options.sparse_points) points.push_back(std::move(c));
    }
  }

  SparseModel model;
  model.cameras = plan.lenses;
  // Keypoints in the order of the points they belong to, then mixed with unmatched ones.
  struct Observation {
    double x, y;
    std::size_t point;  // or kNone
  };
  constexpr std::size_t kNone = ~std::size_t{0};
  std::vector<std::vector<Observation>> observations(plan.shots.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (const Sighting& s : points[p].track) observations[s.shot_idx].push_back({s.x, s.y, p});
  }
  // Ids with gaps, as triangulation and filtering leave them.
  Rng rng(HashOf(options.seed, 101));
  model.points.resize(points.size());
  std::uint64_t id = 17;
  for (std::size_t p = 0; p < points.size(); ++p) {
    model.points[p].point3d_id = id;
    id += 1 + static_cast<std::uint64_t>(rng.Index(5));
    model.points[p].position = points[p].position;
    model.points[p].color = points[p].color;
    model.points[p].error = 0;
  }
  for (std::size_t i = 0; i < plan.shots.size(); ++i) {
    const Shot& shot = plan.shots[i];
    const Lens& lens = plan.lenses[shot.lens_idx];
    std::vector<Observation>& seen = observations[i];
    const auto unmatched = static_cast<std::size_t>(static_cast<double>(seen.size()) *
                                                    kUnmatchedShare / (1 - kUnmatchedShare));
    for (std::size_t k = 0; k < unmatched; ++k) {
      const double x = rng.Uniform(0, lens.width);
      seen.push_back({x, rng.Uniform(0, lens.height), kNone});
    }
    for (std::size_t k = seen.size(); k > 1; --k) {
      std::swap(seen[k - 1], seen[static_cast<std::size_t>(rng.Index(static_cast<int>(k)))]);
    }
    ModelImage image;
    image.image_id = shot.image_id;
    std::copy(std::begin(shot.q), std::end(shot.q), image.q.begin());
    image.t = shot.t;
    image.camera_id = lens.camera_id;
    image.name = shot.name;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      ModelKeypoint keypoint{seen[k].x, seen[k].y, kNoPoint};
      if (seen[k].point != kNone) {
        ModelPoint& point = model.points[seen[k].point];
        keypoint.point3d_id = point.point3d_id;
        point.track.push_back({shot.image_id, static_cast<std::uint32_t>(k)});
        // What COLMAP writes: the mean distance of observation and reprojection.
        const Vec3d c = shot.ToCamera(point.position);
        double x = 0, y = 0;
        lens.Project(c.x / c.z, c.y / c.z, &x, &y);
        point.error += std::hypot(x - seen[k].x, y - seen[k].y);
      }
      image.keypoints.push_back(keypoint);
    }
    model.images.push_back(std::move(image));
  }
  for (ModelPoint& p : model.points) p.error /= static_cast<double>(p.track.size());
  std::sort(model.images.begin(), model.images.end(),
            [](const ModelImage& a, const ModelImage& b) { return a.image_id < b.image_id; });
  return model;
}

SparseModel UndistortModel(const SparseModel& model, const ShotPlan& plan,
                           const std::vector<Lens>& pinholes,
                           const std::vector<std::size_t>& image_order) {
  SparseModel out;
  out.cameras = pinholes;
  out.points = model.points;
  std::map<std::uint32_t, const ModelImage*> by_id;
  for (const ModelImage& image : model.images) by_id[image.image_id] = &image;
  for (const std::size_t i : image_order) {
    const Shot& shot = plan.shots[i];
    const Lens& lens = plan.lenses[shot.lens_idx];
    const Lens& pinhole = pinholes[shot.lens_idx];
    ModelImage image = *by_id.at(shot.image_id);
    for (ModelKeypoint& k : image.keypoints) {
      double u, v;
      lens.Unproject(k.x, k.y, &u, &v);
      k.x = pinhole.fx * u + pinhole.cx;
      k.y = pinhole.fy * v + pinhole.cy;
    }
    out.images.push_back(std::move(image));
  }
  return out;
}

}  // namespace sherd::synthetic
