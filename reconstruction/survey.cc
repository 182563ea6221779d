#include "reconstruction/survey.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sherd {

Vec3d Rigid3d::Rotate(const Vec3d& v) const {
  // v + 2 q x (q x v + w v)
  const Vec3d q{qx, qy, qz};
  const Vec3d t = Cross(q, v) * 2.0;
  return v + t * qw + Cross(q, t);
}

Vec3d Rigid3d::InverseRotate(const Vec3d& v) const {
  const Vec3d q{-qx, -qy, -qz};
  const Vec3d t = Cross(q, v) * 2.0;
  return v + t * qw + Cross(q, t);
}

std::size_t SurveyPoints::MemoryBytes() const {
  const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return bytes(position) + bytes(color) + bytes(normal) + bytes(error) + bytes(photo_begin) +
         bytes(photo_idx);
}

std::optional<Vec3d> EstimateUp(const std::vector<Photograph>& photographs) {
  if (photographs.empty()) return std::nullopt;
  Vec3d sum{};
  Eigen::Matrix3d horizontal = Eigen::Matrix3d::Zero();
  for (const Photograph& photo : photographs) {
    sum += photo.cam_from_world.InverseRotate({0, -1, 0});
    const Vec3d right = photo.cam_from_world.InverseRotate({1, 0, 0});
    const Eigen::Vector3d r(right.x, right.y, right.z);
    horizontal += r * r.transpose();
  }
  const auto n = static_cast<double>(photographs.size());
  const Vec3d mean = sum / n;
  // A photographer holds the camera level, however it is tilted up or down: the direction to which
  // the pictures' horizontal axes are all perpendicular is the vertical. It is certain when those
  // axes span a plane and leave it little.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(horizontal / n);
  const Eigen::Vector3d spread = solver.eigenvalues();
  if (spread(0) < 0.05 && spread(1) > 4 * spread(0) && spread(1) > 0.05) {
    const Eigen::Vector3d v = solver.eigenvectors().col(0);
    const Vec3d vertical{v(0), v(1), v(2)};
    const double sense = Dot(vertical, mean);
    if (std::abs(sense) > 0.2) return Normalized(sense > 0 ? vertical : -vertical);
  }
  // The length of the mean is 1 where all agree. Photographs taken in all directions around a
  // horizontal object still agree on what is up; below a third they say nothing.
  if (!(Length(mean) > 1.0 / 3.0)) return std::nullopt;
  return Normalized(mean);
}

Box3d RobustBounds(const std::vector<Vec3d>& points, double share) {
  Box3d box;
  const double tail = std::clamp((1.0 - share) / 2, 0.0, 0.5);
  double* const mins[] = {&box.min.x, &box.min.y, &box.min.z};
  double* const maxs[] = {&box.max.x, &box.max.y, &box.max.z};
  double Vec3d::*const axes[] = {&Vec3d::x, &Vec3d::y, &Vec3d::z};
  std::vector<double> values;
  values.reserve(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (const Vec3d& p : points) {
      if (IsFinite(p)) values.push_back(p.*axes[axis]);
    }
    if (values.empty()) return {};
    const std::size_t n = values.size();
    const auto low = static_cast<std::size_t>(tail * static_cast<double>(n - 1));
    std::nth_element(values.begin(), values.begin() + low, values.end());
    const double lo = values[low];
    std::nth_element(values.begin(), values.begin() + (n - 1 - low), values.end());
    const double hi = values[n - 1 - low];
    // A tenth of the extent, half of it on each side. Halved first: hi - lo may overflow.
    const double margin = 0.05 * hi - 0.05 * lo;
    *mins[axis] = lo - margin;
    *maxs[axis] = hi + margin;
  }
  return box;
}

}  // namespace sherd
