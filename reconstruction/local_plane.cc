#include "reconstruction/local_plane.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sherd {

LocalPlane FitPlane(const std::vector<Vec3d>& positions, const int* idx, int count) {
  LocalPlane plane;
  if (count < 1) return plane;
  // Relative to the first point: nothing is lost far from the origin.
  Vec3d mean{};
  for (int j = 0; j < count; ++j) mean += positions[idx[j]] - positions[idx[0]];
  mean = mean / double(count);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int j = 0; j < count; ++j) {
    const Vec3d d = positions[idx[j]] - positions[idx[0]] - mean;
    const Eigen::Vector3d v(d.x, d.y, d.z);
    covariance += v * v.transpose();
  }
  const double trace = covariance.trace();
  if (!(trace > 0) || !std::isfinite(trace)) return plane;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.compute(covariance / trace);
  const Eigen::Vector3d n = solver.eigenvectors().col(0);
  plane.normal = Normalized(Vec3d{n.x(), n.y(), n.z()});
  plane.variation = std::max(0.0, solver.eigenvalues()[0]);
  if (count > 3) plane.deviation = std::sqrt(plane.variation * trace / (count - 3));
  return plane;
}

}  // namespace sherd
