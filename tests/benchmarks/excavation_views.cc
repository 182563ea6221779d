#include "tests/benchmarks/excavation_views.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/photographs.h"

namespace sherd {
namespace {

constexpr int kOutsideTheSurvey = 6;  // TruthHit::object_id of ground the dense cloud leaves out

// Whether another camera than `own` sees the point unobstructed.
bool SeenByAnother(const Excavation& truth, const std::vector<Camera>& cameras, std::size_t own,
                   const Vec3d& point, const Vec3d& normal) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (c == own) continue;
    double x = 0, y = 0;
    if (!cameras[c].Project(point, &x, &y) || x < 0 || y < 0 || x >= cameras[c].width ||
        y >= cameras[c].height) {
      continue;
    }
    const Vec3d way = point - cameras[c].eye;
    if (Dot(way, normal) >= 0) continue;
    TruthHit hit;
    if (truth.Intersect({cameras[c].eye, Normalized(way)}, &hit) &&
        hit.distance > Length(way) - 2e-3) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<Camera> PhotographCameras(const Survey& survey, int max_side) {
  std::vector<Camera> cameras;
  for (std::size_t i = 0; i < survey.photographs.size(); ++i) {
    const Camera own = CameraOfPhotograph(survey, i);
    const double scale = static_cast<double>(max_side) / std::max(own.width, own.height);
    cameras.push_back(own.Resized(static_cast<int>(std::lround(own.width * scale)),
                                  static_cast<int>(std::lround(own.height * scale))));
  }
  return cameras;
}

bool SurveyedTruthAt(const Excavation& truth, const std::vector<Camera>& cameras, std::size_t own,
                     const RayD& ray, TruthHit* hit) {
  if (!truth.Intersect(ray, hit) || hit->object_id == kOutsideTheSurvey) return false;
  const Vec3d point = ray.origin + ray.direction * hit->distance;
  return SeenByAnother(truth, cameras, own, point, hit->normal);
}

}  // namespace sherd
