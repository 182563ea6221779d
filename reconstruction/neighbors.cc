#include "reconstruction/neighbors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <vector>

#include "metaball/error.h"
#include "reconstruction/survey.h"

namespace sherd {
namespace {

constexpr std::size_t kPointsPerLeaf = 16;

// What the tree asks about the points: their coordinates in a frame of their own.
struct Points {
  explicit Points(const std::vector<Vec3d>& world)
      : positions(world), frame(SearchFrame::For(world)), inverse_unit(1 / frame.unit) {}

  const std::vector<Vec3d>& positions;
  SearchFrame frame;
  double inverse_unit;

  std::size_t kdtree_get_point_count() const { return positions.size(); }
  double Local(const Vec3d& p, std::size_t axis) const {
    const Vec3d& o = frame.origin;
    return axis == 0   ? SearchFrame::Local(p.x, o.x, inverse_unit)
           : axis == 1 ? SearchFrame::Local(p.y, o.y, inverse_unit)
                       : SearchFrame::Local(p.z, o.z, inverse_unit);
  }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const { return Local(positions[i], axis); }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;  // the tree finds it
  }
};

using Distance = nanoflann::L2_Simple_Adaptor<double, Points, double, int>;
using Tree = nanoflann::KDTreeSingleIndexAdaptor<Distance, Points, 3, int>;

// How many points lie within a radius, without a list of them.
class Counter {
 public:
  explicit Counter(double squared_radius) : squared_radius_(squared_radius) {}

  bool addPoint(double, int) {
    ++count_;
    return true;
  }
  double worstDist() const { return squared_radius_; }
  bool full() const { return true; }
  int count() const { return count_; }

 private:
  double squared_radius_;
  int count_ = 0;
};

}  // namespace

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
  const double inverse = 1 / unit;
  return Vec3d{Local(p.x, origin.x, inverse), Local(p.y, origin.y, inverse),
               Local(p.z, origin.z, inverse)}
      .cast<float>();
}

struct NeighborSearch::Impl {
  explicit Impl(const std::vector<Vec3d>& positions)
      : points(positions), tree(3, points, {kPointsPerLeaf}) {}

  Points points;
  Tree tree;

  const Vec3d& At(std::size_t i) const { return points.positions[i]; }

  template <class Result>
  void Search(const Vec3d& p, Result* result) const {
    const double query[3] = {points.Local(p, 0), points.Local(p, 1), points.Local(p, 2)};
    tree.findNeighbors(*result, query, {});
  }
  // radius: world units.
  int Find(const Vec3d& p, int k, double radius, int* idx, float* distance) const {
    thread_local std::vector<double> squared;
    squared.resize(static_cast<std::size_t>(k));
    nanoflann::KNNResultSet<double, int, int> nearest(k);
    nearest.init(idx, squared.data());
    squared.back() = SquareOf(radius);  // the farthest that is looked at, until k are found
    Search(p, &nearest);
    for (int j = 0; j < nearest.size(); ++j) {
      distance[j] =
          static_cast<float>(std::sqrt(squared[static_cast<std::size_t>(j)]) * points.frame.unit);
    }
    return nearest.size();
  }
  double SquareOf(double radius) const { return std::pow(radius * points.inverse_unit, 2); }
};

NeighborSearch::NeighborSearch(const std::vector<Vec3d>& positions) {
  if (positions.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    throw Error("more than 2147483647 points cannot be searched; load a thinned cloud");
  }
  impl_ = std::make_unique<Impl>(positions);
}

NeighborSearch::~NeighborSearch() = default;

int NeighborSearch::Nearest(std::size_t i, int k, int* idx, float* distance) const {
  return impl_->Find(impl_->At(i), k, INFINITY, idx, distance);
}

int NeighborSearch::Nearest(const Vec3d& p, int k, int* idx, float* distance) const {
  return impl_->Find(p, k, INFINITY, idx, distance);
}

int NeighborSearch::Within(std::size_t i, double radius, int k, int* idx, float* distance) const {
  return impl_->Find(impl_->At(i), k, radius, idx, distance);
}

int NeighborSearch::NearestTo(const Vec3d& p) const {
  int idx = -1;
  float distance = 0;
  return Nearest(p, 1, &idx, &distance) > 0 ? idx : -1;
}

int NeighborSearch::CountWithin(std::size_t i, double radius) const {
  Counter counter(impl_->SquareOf(radius));
  impl_->Search(impl_->At(i), &counter);
  return counter.count();
}

}  // namespace sherd
