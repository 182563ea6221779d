#include "datasets_synthetic/visibility.h"

#include <cmath>

namespace sherd::synthetic {

std::vector<Sighting> FindSightings(const TrenchScene& scene, const ShotPlan& plan,
                                    const std::vector<Lens>& lenses, const Vec3d& point,
                                    const Vec3d& normal, double margin_px) {
  constexpr double kMinCosine = 0.17;  // 80 degrees: more oblique, no matcher finds anything
  constexpr double kClear = 5e-4;      // metres before the point that need not be free
  std::vector<Sighting> sightings;
  for (std::size_t i = 0; i < plan.shots.size(); ++i) {
    const Shot& shot = plan.shots[i];
    const Lens& lens = lenses[shot.lens_idx];
    const Vec3d c = shot.ToCamera(point);
    if (!(c.z > 0.1)) continue;
    Sighting s;
    s.shot_idx = i;
    if (!lens.Project(c.x / c.z, c.y / c.z, &s.x, &s.y)) continue;
    if (!(s.x >= margin_px && s.x <= lens.width - margin_px && s.y >= margin_px &&
          s.y <= lens.height - margin_px)) {
      continue;
    }
    const Vec3d view = point - shot.eye;
    const double distance = Length(view);
    const Vec3d direction = view / distance;
    const double cosine = -Dot(normal, direction);
    if (cosine < kMinCosine) continue;
    if (scene.bvh().Occluded({shot.eye, direction}, distance - kClear)) continue;
    s.pixels_per_metre = lens.fx / c.z * std::sqrt(cosine);
    sightings.push_back(s);
  }
  return sightings;
}

}  // namespace sherd::synthetic
