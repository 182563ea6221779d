#include "app/project/preset_axes.h"

namespace sherd {

PresetAxes AxesFor(const std::optional<Vec3d>& up, const std::optional<Vec3d>& front) {
  PresetAxes axes;
  if (up) axes.up = Normalized(*up);
  const Vec3d u = axes.up;
  Vec3d north{0, 1, 0};
  if (u.z > -1 + 1e-12) {
    // Rodrigues' turn about z x u = (-u.y, u.x, 0), applied to +y.
    const double k = 1 / (1 + u.z);
    north = {-u.x * u.y * k, 1 - u.y * u.y * k, -u.y};
  } else {
    north = {0, -1, 0};
  }
  if (front) {
    const Vec3d level = *front - u * Dot(*front, u);
    if (Length(level) > 1e-6 * Length(*front)) north = level;
  }
  axes.north = Normalized(north - u * Dot(north, u));
  axes.east = Cross(axes.north, u);
  return axes;
}

std::optional<Vec3d> EstimateFront(const std::vector<Photograph>& photographs,
                                   const std::optional<Vec3d>& up) {
  if (photographs.empty() || !up) return std::nullopt;
  const Vec3d u = Normalized(*up);
  constexpr double kOrientedCosine = 0.9994;  // within 2 degrees of +z
  if (u.z > kOrientedCosine) return std::nullopt;
  Vec3d sum{};
  for (const Photograph& photograph : photographs) {
    const Vec3d forward = photograph.cam_from_world.InverseRotate({0, 0, 1});
    sum += forward - u * Dot(forward, u);
  }
  const double agreement = Length(sum) / static_cast<double>(photographs.size());
  if (!(agreement > 0.3)) return std::nullopt;
  return Normalized(sum);
}

}  // namespace sherd
