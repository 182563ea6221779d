#include "reconstruction/seen_through.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "reconstruction/camera_projector.h"
#include "reconstruction/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 4096;
// A grid over a picture so coarse that about this many of its points fall into a cell.
constexpr double kPointsPerCell = 3.0;
constexpr std::size_t kFewestPoints = 300;  // of a photograph that may testify
// How far in front of everything behind it a point must lie: in spacings, and as a share of the
// distance (the noise of stereo grows with it).
constexpr double kMarginSpacings = 3.0;
constexpr double kMarginOfDistance = 0.002;
constexpr std::uint64_t kFewestWitnesses = 3;
constexpr double kMostProjections = 1e9;  // about half a minute of one core

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
    int column, row;
    if (!Locate(x, y, &column, &row)) return;
    double& nearest = nearest_[IndexOf(column, row)];
    nearest = std::min(nearest, depth);
  }

  // The nearest depth in the cell of (x, y) and those around it; infinite where the cell itself, or
  // most of its surroundings, hold no point: there the photograph says nothing.
  double Around(double x, double y) const {
    int column, row;
    if (!Locate(x, y, &column, &row)) return kNothing;
    if (nearest_[IndexOf(column, row)] == kNothing) return kNothing;
    double nearest = kNothing;
    int filled = 0;
    for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r) {
      for (int c = std::max(0, column - 1); c <= std::min(columns_ - 1, column + 1); ++c) {
        const double depth = nearest_[IndexOf(c, r)];
        filled += depth < kNothing;
        nearest = std::min(nearest, depth);
      }
    }
    return filled >= 5 ? nearest : kNothing;
  }

  static constexpr double kNothing = std::numeric_limits<double>::infinity();

 private:
  // The cell that holds (x, y); false outside the picture.
  bool Locate(double x, double y, int* column, int* row) const {
    if (!(x >= 0 && y >= 0 && x < width_ && y < height_)) return false;
    *column = static_cast<int>(x / width_ * columns_);
    *row = static_cast<int>(y / height_ * rows_);
    return true;
  }
  std::size_t IndexOf(int column, int row) const {
    return static_cast<std::size_t>(row) * columns_ + column;
  }

  double width_, height_;
  int columns_ = 1, rows_ = 1;
  std::vector<double> nearest_;
};

}  // namespace

void FindSeenThrough(const Survey& survey, const SurveyPoints& points,
                     const std::vector<float>& spacing, std::vector<char>* stray,
                     const Control& control) {
  const std::size_t n = points.size(), photos = survey.photographs.size();
  if (points.photo_begin.empty() || photos == 0) return;
  const PointsOfPhotos of_photo(points, photos);
  // Large surveys: every few photographs testify, and count for those left out.
  const std::size_t step =
      static_cast<std::size_t>(static_cast<double>(n) * static_cast<double>(photos) /
                               kMostProjections) +
      1;
  const std::size_t asked = (photos + step - 1) / step;
  std::vector<std::atomic<std::uint16_t>> witnesses(n);  // sums: the order does not matter
  ParallelBlocks(
      asked, 1,
      [&](std::size_t block, std::size_t) {
        const std::size_t p = block * step;
        const std::uint64_t begin = of_photo.begin[p], end = of_photo.begin[p + 1];
        if (end - begin < kFewestPoints) return;
        const Photograph& photo = survey.photographs[p];
        const SurveyCamera& camera = survey.cameras[photo.camera_idx];
        const CameraProjector projector(camera);
        NearestDepths depths(camera, end - begin);
        double x = 0, y = 0;
        for (std::uint64_t k = begin; k < end; ++k) {
          const std::uint32_t i = of_photo.point[k];
          if ((*stray)[i]) continue;
          const Vec3d q = photo.cam_from_world.Apply(points.position[i]);
          if (projector.Project(q, &x, &y)) depths.Add(x, y, Length(q));
        }
        for (std::size_t i = 0; i < n; ++i) {
          if (i % (1 << 16) == 0) control.ThrowIfStopped();
          const Vec3d q = photo.cam_from_world.Apply(points.position[i]);
          if (!projector.Project(q, &x, &y)) continue;
          const double distance = Length(q);
          const double behind = depths.Around(x, y);
          const double margin = kMarginSpacings * double(spacing[i]) + kMarginOfDistance * distance;
          if (behind < NearestDepths::kNothing && distance + margin < behind) {
            witnesses[i].fetch_add(1, std::memory_order_relaxed);
          }
        }
      },
      control, "finding points the photographs see through", 0.75, 0.85);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t listed = points.photo_begin[i + 1] - points.photo_begin[i];
    const std::uint64_t count = witnesses[i].load() * step;
    if (count >= kFewestWitnesses && 2 * count > listed) (*stray)[i] = 1;
  }
}

}  // namespace sherd
