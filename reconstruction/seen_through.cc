#include "reconstruction/seen_through.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "reconstruction/camera_projector.h"
#include "reconstruction/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr double kPointsPerCell = 1.0;          // of a photograph, in the grid over its picture
constexpr std::size_t kFewestPoints = 300;      // of a photograph that may testify
constexpr double kBeside = 1.0, kBehind = 1.0;  // spacings
constexpr double kFarthestBeside = 4.0;         // cells: where points are few, no more are read
constexpr int kFewestBehind = 3;
constexpr std::uint64_t kFewestWitnesses = 3;
constexpr double kMostProjections = 1e9;  // about a minute of one core

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

// Where a photograph sees the points it lists, in the cells of a grid over the picture.
class SeenPoints {
 public:
  SeenPoints(const SurveyCamera& camera, std::size_t most)
      : width_(static_cast<double>(camera.width)), height_(static_cast<double>(camera.height)) {
    cell_ = std::sqrt(width_ * height_ * kPointsPerCell /
                      static_cast<double>(std::max<std::size_t>(1, most)));
    columns_ = static_cast<std::uint32_t>(width_ / cell_) + 1;
    rows_ = static_cast<std::uint32_t>(height_ / cell_) + 1;
    seen_.reserve(most);
  }

  // (x, y): pixels.
  void Add(double x, double y, double distance) {
    if (!IsInside(x, y)) return;
    seen_.push_back({RowOf(y) * columns_ + ColumnOf(x), static_cast<float>(x),
                     static_cast<float>(y), static_cast<float>(distance)});
  }

  // Once, after the last Add.
  void Sort() {
    std::sort(seen_.begin(), seen_.end(),
              [](const Seen& a, const Seen& b) { return a.cell < b.cell; });
    begin_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
    for (const Seen& s : seen_) ++begin_[s.cell + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  }

  // Whether enough is seen within `radius` pixels of (x, y), and all of it beyond `distance`.
  bool OnlyBeyond(double x, double y, double radius, double distance) const {
    if (!IsInside(x, y)) return false;
    radius = std::min(radius, kFarthestBeside * cell_);
    const std::uint32_t left = ColumnOf(std::max(0.0, x - radius));
    const std::uint32_t right = std::min(columns_ - 1, ColumnOf(x + radius));
    const std::uint32_t bottom = std::min(rows_ - 1, RowOf(y + radius));
    int count = 0;
    for (std::uint32_t row = RowOf(std::max(0.0, y - radius)); row <= bottom; ++row) {
      const std::size_t first = static_cast<std::size_t>(row) * columns_;
      for (std::uint32_t k = begin_[first + left]; k < begin_[first + right + 1]; ++k) {
        const double dx = seen_[k].x - x, dy = seen_[k].y - y;
        if (dx * dx + dy * dy > radius * radius) continue;
        if (seen_[k].distance < distance) return false;
        ++count;
      }
    }
    return count >= kFewestBehind;
  }

 private:
  struct Seen {
    std::uint32_t cell;
    float x, y, distance;
  };

  bool IsInside(double x, double y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }
  std::uint32_t ColumnOf(double x) const { return static_cast<std::uint32_t>(x / cell_); }
  std::uint32_t RowOf(double y) const { return static_cast<std::uint32_t>(y / cell_); }

  double width_, height_, cell_ = 1;
  std::uint32_t columns_ = 1, rows_ = 1;
  std::vector<Seen> seen_;
  std::vector<std::uint32_t> begin_;
};

}  // namespace

void FindSeenThrough(const Survey& survey, const SurveyPoints& seen,
                     const std::vector<char>& unseen, const SurveyPoints& asked,
                     const std::vector<float>& spacing, std::vector<char>* stray,
                     const Control& control) {
  const std::size_t n = asked.size(), photos = survey.photographs.size();
  if (seen.photo_begin.empty() || photos == 0) return;
  const PointsOfPhotos of_photo(seen, photos);
  // Large surveys: every few photographs testify, and count for those left out.
  const std::size_t step =
      static_cast<std::size_t>(static_cast<double>(n) * static_cast<double>(photos) /
                               kMostProjections) +
      1;
  const std::size_t testifying = (photos + step - 1) / step;
  std::vector<std::atomic<std::uint16_t>> witnesses(n);  // sums: the order does not matter
  ParallelBlocks(
      testifying, 1,
      [&](std::size_t block, std::size_t) {
        const std::size_t p = block * step;
        const std::uint64_t begin = of_photo.begin[p], end = of_photo.begin[p + 1];
        if (end - begin < kFewestPoints) return;
        const Photograph& photo = survey.photographs[p];
        const SurveyCamera& camera = survey.cameras[photo.camera_idx];
        const CameraProjector projector(camera);
        double focal, fy, cx, cy;
        camera.Pinhole(&focal, &fy, &cx, &cy);
        SeenPoints picture(camera, end - begin);
        double x = 0, y = 0;
        for (std::uint64_t k = begin; k < end; ++k) {
          const std::uint32_t i = of_photo.point[k];
          if (!unseen.empty() && unseen[i]) continue;
          const Vec3d q = photo.cam_from_world.Apply(seen.position[i]);
          if (projector.Project(q, &x, &y)) picture.Add(x, y, Length(q));
        }
        picture.Sort();
        for (std::size_t i = 0; i < n; ++i) {
          if (i % (1 << 16) == 0) control.ThrowIfStopped();
          if ((*stray)[i]) continue;
          const Vec3d q = photo.cam_from_world.Apply(asked.position[i]);
          if (!projector.Project(q, &x, &y)) continue;
          const double distance = Length(q), apart = spacing[i];
          if (picture.OnlyBeyond(x, y, kBeside * apart * focal / distance,
                                 distance + kBehind * apart)) {
            witnesses[i].fetch_add(1, std::memory_order_relaxed);
          }
        }
      },
      control, "finding points the photographs see through", 0.75, 0.85);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t listed = asked.photo_begin[i + 1] - asked.photo_begin[i];
    const std::uint64_t count = witnesses[i].load() * step;
    if (count >= kFewestWitnesses && 2 * count > listed) (*stray)[i] = 1;
  }
}

}  // namespace sherd
