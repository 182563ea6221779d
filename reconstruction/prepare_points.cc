// What all levels of a survey share: stray points removed, local spacing, normals; and what is done
// to the points after that.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "metaball/error.h"
#include "metaball/morton.h"
#include "metaball/progress_range.h"
#include "reconstruction/level.h"
#include "reconstruction/local_plane.h"
#include "reconstruction/memory.h"
#include "reconstruction/neighbors.h"
#include "reconstruction/outliers.h"
#include "reconstruction/parallel.h"
#include "reconstruction/point_arrays.h"
#include "reconstruction/seen_through.h"

namespace sherd {
namespace {

constexpr int kNeighbors = kOutlierNeighbors;  // for the normals too, the point not counted
constexpr int kSpacingNeighbors = 8;           // for the spacing
constexpr std::size_t kBlock = 4096;

// Neighbours in space become neighbours in memory: every later pass is faster for it, and no
// result depends on the order of the input file.
std::vector<std::uint32_t> MortonOrder(const std::vector<Vec3d>& positions) {
  const SearchFrame frame = SearchFrame::For(positions);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed;
  keyed.reserve(positions.size());
  const auto coordinate = [](float v) {
    return static_cast<std::uint32_t>(
        std::clamp((static_cast<double>(v) + 4.0) / 8.0 * 2097151.0, 0.0, 2097151.0));
  };
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!IsFinite(positions[i])) continue;
    const Vec3f p = frame.Local(positions[i]);
    keyed.emplace_back(MortonKey63(coordinate(p.x), coordinate(p.y), coordinate(p.z)),
                       static_cast<std::uint32_t>(i));
  }
  std::sort(keyed.begin(), keyed.end());
  std::vector<std::uint32_t> order;
  order.reserve(keyed.size());
  for (const auto& [key, i] : keyed) order.push_back(i);
  return order;
}

// Where a surface at point i is looked at from: the mean direction to the photographs that see it;
// to all photographs where that is not known; outwards where there are none.
class Viewers {
 public:
  Viewers(const Survey& survey, const SurveyPoints& points) : points_(points) {
    for (const Photograph& photo : survey.photographs) {
      centers_.push_back(photo.cam_from_world.Center());
    }
    // Some of them, evenly, say as much as all.
    const std::size_t step = centers_.size() / 64 + 1;
    for (std::size_t i = 0; i < centers_.size(); i += step) some_.push_back(centers_[i]);
    const Box3d box = RobustBounds(points.position);
    middle_ = box.min * 0.5 + box.max * 0.5;
  }

  Vec3d DirectionAt(std::size_t i) const {
    const Vec3d& p = points_.position[i];
    Vec3d sum{};
    if (!points_.photo_begin.empty()) {
      for (std::uint64_t j = points_.photo_begin[i]; j < points_.photo_begin[i + 1]; ++j) {
        sum += Normalized(centers_[points_.photo_idx[j]] - p, Vec3d{});
      }
    }
    if (Length(sum) > 0) return sum;
    for (const Vec3d& center : some_) sum += Normalized(center - p, Vec3d{});
    return Length(sum) > 0 ? sum : p - middle_;
  }

 private:
  const SurveyPoints& points_;
  std::vector<Vec3d> centers_, some_;
  Vec3d middle_{};
};

bool IsUsableNormal(const Vec3f& n) {
  const float length = Length(n);
  return length > 0.1f && length < 10.0f;  // false for NaN
}

// Spacings, and normals where the survey has none; returns the mean distance of each point's
// neighbours.
std::vector<float> MeasureNeighbors(const Survey& survey, const NeighborSearch& search,
                                    PreparedPoints* out, const Control& control) {
  const std::size_t n = out->points.size();
  out->spacing.assign(n, 0.0f);
  std::vector<float> mean(n, 0.0f);
  const bool own_normals = out->points.normal.size() == n;
  if (!own_normals) out->points.normal.assign(n, Vec3f{});
  const Viewers viewers(survey, out->points);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kNeighbors + 1];
        float distance[kNeighbors + 1];
        for (std::size_t i = begin; i < end; ++i) {
          const int count = search.Nearest(i, kNeighbors + 1, idx, distance);
          double sum = 0;
          for (int j = 1; j < count; ++j) sum += distance[j];
          if (count > 1) mean[i] = static_cast<float>(sum / (count - 1));
          const int k = std::min(kSpacingNeighbors, count - 1);
          if (k > 0) {
            out->spacing[i] = static_cast<float>(distance[k] * std::sqrt(std::numbers::pi / k));
          }
          Vec3f& normal = out->points.normal[i];
          if (own_normals && IsUsableNormal(normal)) {
            normal = Normalized(normal);
          } else {
            const Vec3d least = FitPlane(out->points.position, idx, count).normal;
            const Vec3d towards = viewers.DirectionAt(i);
            normal = (Dot(least, towards) < 0 ? -least : least).cast<float>();
          }
        }
      },
      control, "measuring the spacing", 0.1, 0.7);
  return mean;
}

}  // namespace

PreparedPoints PreparePoints(const Survey& survey, bool remove_outliers, const Control& control) {
  CheckMemory("copying the survey's points", survey.points.MemoryBytes());
  return PreparePoints(survey.points, survey, remove_outliers, control);
}

PreparedPoints PreparePoints(SurveyPoints points, const Survey& survey, bool remove_outliers,
                             const Control& control) {
  const std::size_t source = points.size();
  if (source == 0) {
    throw InputError("", "", "the survey holds no points",
                     "a sparse model with points or a fused cloud is needed");
  }
  if (source > UINT32_MAX) {
    throw ResourceError("more than 4294967295 points cannot be prepared; load a thinned cloud",
                        source, UINT32_MAX);
  }
  // The order and a copy of one array; the tree, the neighbour figures.
  CheckMemory("preparing " + std::to_string(source) + " points",
              std::max<std::size_t>(source * (15 + 4 + 24), points.photo_idx.size() * 4));
  control.ThrowIfStopped();
  control.Report("sorting points", 0.0);
  PreparedPoints out;
  out.source_points = source;
  {
    const std::vector<std::uint32_t> order = MortonOrder(points.position);
    out.outliers = source - order.size();  // not finite
    Rearrange(order, &points);
    out.points = std::move(points);
  }
  const std::size_t n = out.points.size();
  if (n == 0) throw InputError("", "", "the survey holds no point with finite coordinates");
  control.ThrowIfStopped();
  control.Report("building the search tree", 0.05);
  std::vector<char> stray;
  {
    const NeighborSearch search(out.points.position);
    control.ThrowIfStopped();
    const std::vector<float> mean = MeasureNeighbors(survey, search, &out, control);
    if (remove_outliers && n > 4 * kNeighbors) {
      stray.assign(n, 0);
      FindSparse(search, out.points.position, mean, &stray, control);
      FindSeenThrough(survey, out.points, stray, out.points, out.spacing, &stray, control);
      FindClumps(search, out.spacing, &stray, control);
    }
  }
  if (!stray.empty()) RemoveStray(stray, &out);
  control.Report("points prepared", 1.0);
  return out;
}

PreparedPoints PrepareForLevels(SurveyPoints source, const Survey& survey,
                                const LevelOptions& options, const Control& control) {
  PreparedPoints points =
      PreparePoints(std::move(source), survey, options.remove_outliers, PartOf(control, 0, 0.6));
  if (options.smooth_noise) {
    SmoothNoise(options.remove_outliers, &points, PartOf(control, 0.6, 0.85));
  }
  if (options.close_holes) CloseHoles(survey, &points, PartOf(control, 0.85, 0.95));
  if (options.nested) OrderPoints(options.reduction, &points, PartOf(control, 0.95, 1));
  return points;
}

}  // namespace sherd
