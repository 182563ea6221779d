// Which photographs are taken, from where and with what camera.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "datasets_synthetic/excavation.h"
#include "datasets_synthetic/lens.h"
#include "metaball/camera.h"
#include "metaball/vec.h"

namespace sherd::synthetic {

struct Shot {
  std::string name;            // ring_01.jpg, overhead_01.jpg
  std::uint32_t image_id = 0;  // not contiguous, and not in the order of the names
  std::size_t lens_idx = 0;
  Vec3d eye{}, right{}, down{}, forward{};  // world; COLMAP's camera axes
  double q[4] = {1, 0, 0, 0};               // cam_from_world: w, x, y, z; unit, w >= 0
  Vec3d t{};                                // cam_from_world
  float exposure = 1;                       // factor on the linear picture
  double focal_35mm = 28;                   // for the EXIF record

  Vec3d ToCamera(const Vec3d& p) const {
    const Vec3d d = p - eye;
    return {Dot(d, right), Dot(d, down), Dot(d, forward)};
  }
  // The ray through the direction (u, v, 1) of the camera's frame.
  RayD RayOf(double u, double v) const { return {eye, Normalized(forward + right * u + down * v)}; }
};

struct ShotPlan {
  std::vector<Lens> lenses;
  std::vector<Shot> shots;  // in the order of their names
};

// A ring of tilted views, at most 22.5 degrees apart (fewer than 16 of them make an arc in the
// south), and for every seven of them three of an overhead row.
ShotPlan PlanShots(const ExcavationOptions& options);

}  // namespace sherd::synthetic
