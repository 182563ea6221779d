#include "reconstruction/geometric_visibility.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "reconstruction/camera_projector.h"
#include "reconstruction/memory.h"
#include "reconstruction/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 8192;
constexpr float kNothing = std::numeric_limits<float>::infinity();
// Of the points in a filled cell, on the mean. Both sides of an object fall into one.
constexpr double kPointsPerCell = 4.0;
// How far behind the nearest a point may lie and still be of the same surface: in cells (the
// tangent of the steepest slope), and as a share of the distance.
constexpr double kSlope = 3.0;
constexpr double kMarginOfDistance = 0.003;
constexpr int kHidingNeighbors = 5;  // of eight
constexpr double kLeastCosine = 0.1;

struct Projected {
  float x = 0, y = 0;
  float distance = kNothing;  // along the ray; infinite: outside the picture
};

// The nearest distance in each cell of a grid over the picture.
class DepthGrid {
 public:
  DepthGrid(const SurveyCamera& camera, const std::vector<Projected>& points)
      : width_(static_cast<double>(camera.width)), height_(static_cast<double>(camera.height)) {
    std::size_t inside = 0;
    for (const Projected& p : points) inside += p.distance < kNothing;
    // First as if the points filled the picture, then as finely as they do where they are.
    double cells = static_cast<double>(inside) / kPointsPerCell;
    Fill(points, cells);
    const auto filled = static_cast<double>(
        std::count_if(nearest_.begin(), nearest_.end(), [](float d) { return d < kNothing; }));
    if (filled > 0) {
      cells *= std::min(64.0, static_cast<double>(nearest_.size()) / filled);
      Fill(points, cells);
    }
  }

  double side() const { return side_; }  // of a cell, pixels

  bool Hides(const Projected& p, float margin) const {
    const int column = Column(p), row = Row(p);
    const float limit = p.distance - margin;
    if (nearest_[Index(column, row)] < limit) return true;
    int hiding = 0;
    for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r) {
      for (int c = std::max(0, column - 1); c <= std::min(columns_ - 1, column + 1); ++c) {
        hiding += nearest_[Index(c, r)] < limit;
      }
    }
    return hiding >= kHidingNeighbors;
  }

 private:
  void Fill(const std::vector<Projected>& points, double cells) {
    side_ = std::max(1.0, std::sqrt(width_ * height_ / std::max(1.0, cells)));
    columns_ = std::max(1, static_cast<int>(std::ceil(width_ / side_)));
    rows_ = std::max(1, static_cast<int>(std::ceil(height_ / side_)));
    nearest_.assign(static_cast<std::size_t>(columns_) * rows_, kNothing);
    for (const Projected& p : points) {
      if (!(p.distance < kNothing)) continue;
      float& nearest = nearest_[Index(Column(p), Row(p))];
      nearest = std::min(nearest, p.distance);
    }
  }
  int Column(const Projected& p) const {
    return std::clamp(static_cast<int>(p.x / side_), 0, columns_ - 1);
  }
  int Row(const Projected& p) const {
    return std::clamp(static_cast<int>(p.y / side_), 0, rows_ - 1);
  }
  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row) * columns_ + column;
  }

  double width_, height_, side_ = 1;
  int columns_ = 1, rows_ = 1;
  std::vector<float> nearest_;
};

struct Seen {
  std::uint32_t photo = UINT32_MAX;
  float score = 0;
};

// Keeps the best, the earlier photograph first among equals.
void Keep(const Seen& seen, Seen* best, int most) {
  int worst = 0;
  for (int k = 0; k < most; ++k) {
    if (best[k].photo == UINT32_MAX) {
      best[k] = seen;
      return;
    }
    if (best[k].score < best[worst].score ||
        (best[k].score == best[worst].score && best[k].photo > best[worst].photo)) {
      worst = k;
    }
  }
  if (seen.score > best[worst].score) best[worst] = seen;
}

}  // namespace

FoundVisibility FindVisibility(const VisibilityOptions& options, Survey* survey,
                               const Control& control) {
  SurveyPoints& points = survey->points;
  const std::size_t n = points.size(), photos = survey->photographs.size();
  FoundVisibility found;
  const bool nothing_known = points.photo_begin.empty();
  const auto is_wanted = [&](std::size_t i) {
    return nothing_known || points.photo_begin[i] == points.photo_begin[i + 1];
  };
  std::vector<std::uint32_t> wanted;
  for (std::size_t i = 0; i < n; ++i) {
    if (is_wanted(i)) wanted.push_back(static_cast<std::uint32_t>(i));
  }
  found.points = wanted.size();
  if (wanted.empty() || photos == 0) return found;
  const int most = std::max(1, options.most_photographs);
  CheckMemory("finding the photographs of " + std::to_string(wanted.size()) + " points",
              n * sizeof(Projected) + wanted.size() * (4 + 12 * static_cast<std::uint64_t>(most)),
              options.memory_limit_bytes);
  std::vector<Projected> projected(n);
  std::vector<Seen> best(wanted.size() * static_cast<std::size_t>(most));
  const bool normals = points.normal.size() == n;
  for (std::size_t j = 0; j < photos; ++j) {
    control.Report("finding the photographs of the points",
                   static_cast<double>(j) / static_cast<double>(photos));
    const Photograph& photo = survey->photographs[j];
    const SurveyCamera& camera = survey->cameras[photo.camera_idx];
    const CameraProjector projector(camera);
    const auto width = static_cast<double>(camera.width);
    const auto height = static_cast<double>(camera.height);
    ParallelBlocks(
        n, kBlock,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            const Vec3d q = photo.cam_from_world.Apply(points.position[i]);
            Projected& p = projected[i];
            double x, y;
            p.distance = kNothing;
            if (!projector.Project(q, &x, &y) || !(x >= 0 && y >= 0 && x < width && y < height)) {
              continue;
            }
            p = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(Length(q))};
          }
        },
        control);
    const DepthGrid grid(camera, projected);
    double fx, fy, cx, cy;
    camera.Pinhole(&fx, &fy, &cx, &cy);
    const double cell = grid.side() / fx;  // at distance 1
    const Vec3d center = photo.cam_from_world.Center();
    ParallelBlocks(
        wanted.size(), kBlock,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t w = begin; w < end; ++w) {
            const std::size_t i = wanted[w];
            const Projected& p = projected[i];
            if (!(p.distance < kNothing)) continue;
            double cosine = 1;
            if (normals && Length(points.normal[i]) > 0.5f) {
              const Vec3d towards = Normalized(center - points.position[i], Vec3d{});
              cosine = Dot(Normalized(points.normal[i]).cast<double>(), towards);
              if (!(cosine > kLeastCosine)) continue;
            }
            const double margin = p.distance * (kSlope * cell + kMarginOfDistance);
            if (grid.Hides(p, static_cast<float>(margin))) continue;
            Keep({static_cast<std::uint32_t>(j), static_cast<float>(cosine * fx / p.distance)},
                 &best[w * static_cast<std::size_t>(most)], most);
          }
        },
        control);
  }

  // The lists of all points anew.
  std::vector<std::uint64_t> begin{0};
  std::vector<std::uint32_t> idx;
  begin.reserve(n + 1);
  std::size_t w = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (w < wanted.size() && wanted[w] == i) {
      const std::size_t first = idx.size();
      for (int k = 0; k < most; ++k) {
        const Seen& seen = best[w * static_cast<std::size_t>(most) + static_cast<std::size_t>(k)];
        if (seen.photo != UINT32_MAX) idx.push_back(seen.photo);
      }
      std::sort(idx.begin() + static_cast<std::ptrdiff_t>(first), idx.end());
      found.seen += idx.size() > first;
      ++w;
    } else {
      idx.insert(idx.end(), points.photo_idx.begin() + points.photo_begin[i],
                 points.photo_idx.begin() + points.photo_begin[i + 1]);
    }
    begin.push_back(idx.size());
  }
  points.photo_begin = std::move(begin);
  points.photo_idx = std::move(idx);
  return found;
}

}  // namespace sherd
