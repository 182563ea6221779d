#include "reconstruction/seen_through.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "metaball/parallel.h"
#include "reconstruction/camera_projector.h"

namespace sherd {
namespace {

// A grid over a picture so coarse that about this many of its points fall into a cell.
constexpr double kPointsPerCell = 3.0;
constexpr std::size_t kFewestPoints = 300;  // of a photograph that may testify
// How far in front of everything behind it a point must lie: in spacings, and as a share of the
// distance (the noise of stereo grows with it).
constexpr double kMarginSpacings = 3.0;
constexpr double kMarginOfDistance = 0.002;
constexpr int kFewestWitnesses = 3;

// For each photograph the points it is listed for.
struct PointsOfPhotos {
  std::vector<std::uint64_t> begin;
  std::vector<std::uint32_t> point;

  PointsOfPhotos(const SurveyPoints& points, std::size_t photos) : begin(photos + 1, 0) {
    for (const std::uint32_t photo : points.photo_idx) ++begin[photo + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    point.resize(points.photo_idx.size());
    std::vector<std::uint64_t> next(begin.begin(), begin.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::uint64_t k = points.photo_begin[i]; k < points.photo_begin[i + 1]; ++k) {
        point[next[points.photo_idx[k]]++] = static_cast<std::uint32_t>(i);
      }
    }
  }
};

// The nearest depth at which a photograph sees its own points, in a coarse grid over the picture.
class NearestDepths {
 public:
  NearestDepths(const SurveyCamera& camera, std::size_t points)
      : width_(static_cast<double>(camera.width)), height_(static_cast<double>(camera.height)) {
    const double cells = std::max(1.0, static_cast<double>(points) / kPointsPerCell);
    const double side = std::sqrt(width_ * height_ / cells);
    columns_ = std::max(1, static_cast<int>(width_ / side));
    rows_ = std::max(1, static_cast<int>(height_ / side));
    nearest_.assign(static_cast<std::size_t>(columns_) * rows_,
                    std::numeric_limits<double>::infinity());
  }

  void Add(double x, double y, double depth) {
    double* const cell = Cell(x, y);
    if (cell) *cell = std::min(*cell, depth);
  }

  // The nearest depth in the cell of (x, y) and those around it; infinite where the cell itself, or
  // most of its surroundings, hold no point: there the photograph says nothing.
  double Around(double x, double y) const {
    if (!const_cast<NearestDepths*>(this)->Cell(x, y)) return kNothing;
    const int column = static_cast<int>(x / width_ * columns_);
    const int row = static_cast<int>(y / height_ * rows_);
    if (nearest_[static_cast<std::size_t>(row) * columns_ + column] == kNothing) return kNothing;
    double nearest = kNothing;
    int filled = 0;
    for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r) {
      for (int c = std::max(0, column - 1); c <= std::min(columns_ - 1, column + 1); ++c) {
        const double depth = nearest_[static_cast<std::size_t>(r) * columns_ + c];
        filled += depth < kNothing;
        nearest = std::min(nearest, depth);
      }
    }
    return filled >= 5 ? nearest : kNothing;
  }

  static constexpr double kNothing = std::numeric_limits<double>::infinity();

 private:
  double* Cell(double x, double y) {
    if (!(x >= 0 && y >= 0 && x < width_ && y < height_)) return nullptr;
    const int column = static_cast<int>(x / width_ * columns_);
    const int row = static_cast<int>(y / height_ * rows_);
    return &nearest_[static_cast<std::size_t>(row) * columns_ + column];
  }

  double width_, height_;
  int columns_ = 1, rows_ = 1;
  std::vector<double> nearest_;
};

}  // namespace

std::vector<bool> FindSeenThrough(const Survey& survey, const SurveyPoints& points, double spacing,
                                  const Control& control) {
  const std::size_t n = points.size();
  std::vector<bool> seen_through(n, false);
  if (points.photo_begin.empty() || !(spacing > 0)) return seen_through;
  const PointsOfPhotos of_photo(points, survey.photographs.size());
  std::vector<std::atomic<std::uint16_t>> witnesses(n);  // sums: the order does not matter
  std::atomic<std::size_t> done{0};
  ParallelFor(static_cast<std::int64_t>(survey.photographs.size()), 0, [&](std::int64_t p, int) {
    control.ThrowIfStopped();
    const std::uint64_t begin = of_photo.begin[p], end = of_photo.begin[p + 1];
    if (end - begin >= kFewestPoints) {
      const Photograph& photo = survey.photographs[p];
      const SurveyCamera& camera = survey.cameras[photo.camera_idx];
      const CameraProjector projector(camera);
      NearestDepths depths(camera, end - begin);
      double x = 0, y = 0;
      for (std::uint64_t k = begin; k < end; ++k) {
        const Vec3d q = photo.cam_from_world.Apply(points.position[of_photo.point[k]]);
        if (projector.Project(q, &x, &y)) depths.Add(x, y, Length(q));
      }
      for (std::size_t i = 0; i < n; ++i) {
        const Vec3d q = photo.cam_from_world.Apply(points.position[i]);
        if (!projector.Project(q, &x, &y)) continue;
        const double distance = Length(q);
        const double behind = depths.Around(x, y);
        if (behind < NearestDepths::kNothing &&
            distance + kMarginSpacings * spacing + kMarginOfDistance * distance < behind) {
          ++witnesses[i];
        }
      }
    }
    control.Report("finding points the photographs see through",
                   static_cast<double>(++done) / static_cast<double>(survey.photographs.size()));
  });
  for (std::size_t i = 0; i < n; ++i) {
    const auto listed = points.photo_begin[i + 1] - points.photo_begin[i];
    seen_through[i] =
        witnesses[i] >= kFewestWitnesses && 2 * witnesses[i] > static_cast<int>(listed);
  }
  return seen_through;
}

}  // namespace sherd
