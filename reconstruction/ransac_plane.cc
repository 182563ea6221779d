#include "reconstruction/ransac_plane.h"

#include <pcl/console/print.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>

namespace sherd {

// pcl::SACSegmentation is these two classes behind names, in a component that asks for VTK.
std::optional<FoundPlane> RansacPlane(const std::vector<Vec3f>& points, double tolerance,
                                      const std::optional<Vec3f>& axis, double angle_rad) {
  using Model = pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>;
  if (points.size() < 3) return std::nullopt;
  const pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  cloud->reserve(points.size());
  for (const Vec3f& p : points) cloud->emplace_back(p.x, p.y, p.z);
  const Model::Ptr model(new Model(cloud, /*random=*/false));  // a fixed seed
  if (axis) {
    model->setAxis({axis->x, axis->y, axis->z});
    model->setEpsAngle(angle_rad);
  }
  pcl::RandomSampleConsensus<pcl::PointXYZ> search(model, tolerance);
  search.setProbability(0.999);
  search.setMaxIterations(10000);  // 6900 find three points of a tenth of all
  // Samples on a line are tried again, which is no news for a user.
  const auto verbosity = pcl::console::getVerbosityLevel();
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  const bool found = search.computeModel();
  pcl::console::setVerbosityLevel(verbosity);
  if (!found) return std::nullopt;
  Eigen::VectorXf plane;
  search.getModelCoefficients(plane);
  return FoundPlane{{plane[0], plane[1], plane[2]}, plane[3]};
}

}  // namespace sherd
