#include "reconstruction/neighbors.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "metaball/error.h"
#include "reconstruction/survey.h"

namespace sherd {

SearchFrame SearchFrame::For(const std::vector<Vec3d>& positions) {
  SearchFrame frame;
  const Box3d box = RobustBounds(positions);
  frame.origin = box.min * 0.5 + box.max * 0.5;
  const Vec3d half = box.max * 0.5 - box.min * 0.5;
  const double extent = std::max({half.x, half.y, half.z});
  if (extent > 0 && std::isfinite(extent)) frame.unit = extent;
  return frame;
}

Vec3f SearchFrame::Local(const Vec3d& p) const {
  constexpr double kFarthest = 1e4;
  const Vec3d q = (p - origin) / unit;
  return Vec3d{std::clamp(q.x, -kFarthest, kFarthest), std::clamp(q.y, -kFarthest, kFarthest),
               std::clamp(q.z, -kFarthest, kFarthest)}
      .cast<float>();
}

struct NeighborSearch::Impl {
  SearchFrame frame;
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud{new pcl::PointCloud<pcl::PointXYZ>};
  pcl::KdTreeFLANN<pcl::PointXYZ> tree{/*sorted=*/true};
};

NeighborSearch::NeighborSearch(const std::vector<Vec3d>& positions)
    : impl_(std::make_unique<Impl>()) {
  if (positions.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    throw Error("more than 2147483647 points cannot be searched; load a thinned cloud");
  }
  impl_->frame = SearchFrame::For(positions);
  impl_->cloud->reserve(positions.size());
  for (const Vec3d& p : positions) {
    const Vec3f q = impl_->frame.Local(p);
    impl_->cloud->emplace_back(q.x, q.y, q.z);
  }
  if (!positions.empty()) impl_->tree.setInputCloud(impl_->cloud);
}

NeighborSearch::~NeighborSearch() = default;

int NeighborSearch::Nearest(std::size_t i, int k, int* idx, float* distance) const {
  thread_local pcl::Indices indices;
  thread_local std::vector<float> squared;
  const int found = impl_->tree.nearestKSearch((*impl_->cloud)[i], k, indices, squared);
  for (int j = 0; j < found; ++j) {
    idx[j] = indices[j];
    distance[j] =
        static_cast<float>(std::sqrt(static_cast<double>(squared[j])) * impl_->frame.unit);
  }
  return found;
}

int NeighborSearch::Within(std::size_t i, double radius, int k, int* idx, float* distance) const {
  thread_local pcl::Indices indices;
  thread_local std::vector<float> squared;
  const int found = impl_->tree.radiusSearch((*impl_->cloud)[i], radius / impl_->frame.unit,
                                             indices, squared, static_cast<unsigned>(k));
  for (int j = 0; j < found; ++j) {
    idx[j] = indices[j];
    distance[j] =
        static_cast<float>(std::sqrt(static_cast<double>(squared[j])) * impl_->frame.unit);
  }
  return found;
}

int NeighborSearch::NearestTo(const Vec3d& p) const {
  if (impl_->cloud->empty()) return -1;
  thread_local pcl::Indices indices;
  thread_local std::vector<float> squared;
  const Vec3f q = impl_->frame.Local(p);
  const int found = impl_->tree.nearestKSearch(pcl::PointXYZ(q.x, q.y, q.z), 1, indices, squared);
  return found > 0 ? indices[0] : -1;
}

int NeighborSearch::CountWithin(std::size_t i, double radius) const {
  thread_local pcl::Indices indices;
  thread_local std::vector<float> squared;
  return impl_->tree.radiusSearch((*impl_->cloud)[i], radius / impl_->frame.unit, indices, squared);
}

}  // namespace sherd
