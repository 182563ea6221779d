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

  pcl::PointXYZ Local(const Vec3d& p) const {
    const Vec3f q = frame.Local(p);
    return {q.x, q.y, q.z};
  }
  // search(&indices, &squared distances) returns how many it found.
  template <class Search>
  int Find(const Search& search, int* idx, float* distance) const {
    thread_local pcl::Indices indices;
    thread_local std::vector<float> squared;
    const int found = search(&indices, &squared);
    for (int j = 0; j < found; ++j) {
      const auto k = static_cast<std::size_t>(j);
      idx[j] = indices[k];
      distance[j] = static_cast<float>(std::sqrt(static_cast<double>(squared[k])) * frame.unit);
    }
    return found;
  }
  int Nearest(const pcl::PointXYZ& p, int k, int* idx, float* distance) const {
    return Find([&](auto* i, auto* d) { return tree.nearestKSearch(p, k, *i, *d); }, idx, distance);
  }
};

NeighborSearch::NeighborSearch(const std::vector<Vec3d>& positions)
    : impl_(std::make_unique<Impl>()) {
  if (positions.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    throw Error("more than 2147483647 points cannot be searched; load a thinned cloud");
  }
  impl_->frame = SearchFrame::For(positions);
  impl_->cloud->reserve(positions.size());
  for (const Vec3d& p : positions) impl_->cloud->push_back(impl_->Local(p));
  if (!positions.empty()) impl_->tree.setInputCloud(impl_->cloud);
}

NeighborSearch::~NeighborSearch() = default;

int NeighborSearch::Nearest(std::size_t i, int k, int* idx, float* distance) const {
  return impl_->Nearest((*impl_->cloud)[i], k, idx, distance);
}

int NeighborSearch::Nearest(const Vec3d& p, int k, int* idx, float* distance) const {
  if (impl_->cloud->empty()) return 0;
  return impl_->Nearest(impl_->Local(p), k, idx, distance);
}

int NeighborSearch::Within(std::size_t i, double radius, int k, int* idx, float* distance) const {
  return impl_->Find(
      [&](auto* found, auto* squared) {
        return impl_->tree.radiusSearch((*impl_->cloud)[i], radius / impl_->frame.unit, *found,
                                        *squared, static_cast<unsigned>(k));
      },
      idx, distance);
}

int NeighborSearch::NearestTo(const Vec3d& p) const {
  int idx = -1;
  float distance = 0;
  return Nearest(p, 1, &idx, &distance) > 0 ? idx : -1;
}

int NeighborSearch::CountWithin(std::size_t i, double radius) const {
  thread_local pcl::Indices indices;
  thread_local std::vector<float> squared;
  return impl_->tree.radiusSearch((*impl_->cloud)[i], radius / impl_->frame.unit, indices, squared);
}

}  // namespace sherd
