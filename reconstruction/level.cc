#include "reconstruction/level.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "metaball/error.h"
#include "metaball/median.h"
#include "metaball/stopwatch.h"
#include "reconstruction/downsample.h"
#include "reconstruction/memory.h"
#include "reconstruction/parallel.h"
#include "reconstruction/point_arrays.h"
#include "reconstruction/reduction.h"
#include "reconstruction/surface_fit.h"

namespace sherd {
namespace {

constexpr double kDefaultThreshold = 0.7;
constexpr std::size_t kBlock = 2048;

// One metaball for each cell: the centroid, the mean colour in linear light, the mean normal.
struct Representatives {
  std::vector<Vec3d> position;
  std::vector<Rgb8> color;
  std::vector<Vec3f> normal;
};

Representatives Reduce(const SurveyPoints& points, const PointCells& cells,
                       const Control& control) {
  Representatives out;
  const std::size_t n = cells.size();
  const bool colors = !points.color.empty();
  out.position.resize(n);
  if (colors) out.color.resize(n);
  out.normal.resize(n);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) {
          const std::uint32_t* const first = cells.point_idx.data() + cells.cell_begin[c];
          const std::uint32_t* const last = cells.point_idx.data() + cells.cell_begin[c + 1];
          const double count = static_cast<double>(last - first);
          if (count == 1) {
            out.position[c] = points.position[*first];
            if (colors) out.color[c] = points.color[*first];
            out.normal[c] = points.normal[*first];
            continue;
          }
          Vec3d color{}, normal{};
          for (const std::uint32_t* i = first; i != last; ++i) {
            if (colors) color += LinearFromRgb8(points.color[*i]).cast<double>();
            normal += points.normal[*i].cast<double>();
          }
          out.position[c] = cells.seed.empty() ? CentroidOf(points.position, cells, c)
                                               : points.position[cells.seed[c]];
          if (colors) out.color[c] = Rgb8FromLinear((color / count).cast<float>());
          out.normal[c] = Normalized(normal, points.normal[*first].cast<double>()).cast<float>();
        }
      },
      control, "averaging points", 0.3, 0.4);
  return out;
}

// The photographs that see metaball c best: listed by as many of its points as possible, squarely
// and from near.
class PhotoRanking {
 public:
  PhotoRanking(const Survey& survey, const SurveyPoints& points, const PointCells& cells, int most)
      : points_(points), cells_(cells), most_(static_cast<std::size_t>(std::max(0, most))) {
    for (const Photograph& photo : survey.photographs) {
      centers_.push_back(photo.cam_from_world.Center());
      double fx, fy, cx, cy;
      survey.cameras[photo.camera_idx].Pinhole(&fx, &fy, &cx, &cy);
      focal_.push_back(fx);
    }
  }

  void Rank(std::size_t c, const Vec3d& position, const Vec3f& normal,
            std::vector<std::uint16_t>* out) const {
    thread_local std::vector<std::uint32_t> seen;
    thread_local std::vector<std::pair<double, std::uint32_t>> ranked;
    seen.clear();
    ranked.clear();
    for (std::uint32_t i = cells_.cell_begin[c]; i < cells_.cell_begin[c + 1]; ++i) {
      const std::uint32_t p = cells_.point_idx[i];
      seen.insert(seen.end(), points_.photo_idx.begin() + points_.photo_begin[p],
                  points_.photo_idx.begin() + points_.photo_begin[p + 1]);
    }
    std::sort(seen.begin(), seen.end());
    for (std::size_t i = 0; i < seen.size();) {
      std::size_t end = i;
      while (end < seen.size() && seen[end] == seen[i]) ++end;
      const std::uint32_t photo = seen[i];
      const auto count = static_cast<double>(end - i);
      i = end;
      if (photo > UINT16_MAX) continue;  // a level's lists have no room for more photographs
      const Vec3d to_camera = centers_[photo] - position;
      const double distance = Length(to_camera);
      if (!(distance > 0)) continue;
      const double cosine = Dot(normal.cast<double>(), to_camera) / distance;
      ranked.emplace_back(-count * std::max(cosine, 0.02) * focal_[photo] / distance, photo);
    }
    const std::size_t kept = std::min(most_, ranked.size());
    std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(kept),
                      ranked.end());
    out->clear();
    for (std::size_t i = 0; i < kept; ++i) {
      out->push_back(static_cast<std::uint16_t>(ranked[i].second));
    }
  }

 private:
  const SurveyPoints& points_;
  const PointCells& cells_;
  std::size_t most_;
  std::vector<Vec3d> centers_;
  std::vector<double> focal_;
};

Channel SurveyedShares(const PointCells& cells, std::size_t surveyed) {
  Channel share(kSurveyedChannel, ChannelType::kUnorm8, 1, cells.size());
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const std::uint32_t* const first = cells.point_idx.data() + cells.cell_begin[c];
    const std::uint32_t* const last = cells.point_idx.data() + cells.cell_begin[c + 1];
    const auto count = std::count_if(first, last, [&](std::uint32_t i) { return i < surveyed; });
    share.Set(c, {{static_cast<float>(count) / static_cast<float>(last - first)}});
  }
  return share;
}

}  // namespace

Level BuildLevel(const PreparedPoints& prepared, const Survey& survey, const LevelOptions& options,
                 const Control& control) {
  const Stopwatch watch;
  const SurveyPoints& points = prepared.points;
  const std::size_t n = points.size();
  if (options.target_count == 0) {
    throw InputError("", "", "a level needs at least one metaball");
  }
  if (n == 0) throw InputError("", "", "the survey holds no points");
  const std::uint64_t wanted = std::min<std::uint64_t>(options.target_count, n);
  CheckMemory("building the level " + FormatCount(options.target_count),
              n * 8 + wanted * (8 * 16 + 200));

  control.Report("reducing the points", 0.0);
  const PointCells cells = ReducePoints(prepared, options, control);
  Representatives reduced = Reduce(points, cells, control);
  const double threshold = options.threshold > 0 ? options.threshold : kDefaultThreshold;
  const FittedMetaballs fitted =
      FitSurface(points, cells, std::move(reduced.position), std::move(reduced.normal),
                 options.radius_factor, threshold, control);
  const SurfaceErrors errors = MeasureErrors(prepared, cells, fitted, threshold, control);

  Level level;
  level.name = FormatCount(options.target_count);
  level.stats.spacing = fitted.median_spacing;
  level.stats.open_share = fitted.open_share;
  level.stats.error_mean = errors.mean;
  level.stats.error_p95 = errors.p95;
  level.stats.error_max = errors.largest;
  CloudInput input;
  input.center.reserve(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) input.center.push_back(fitted.CenterOf(i));
  input.radius = fitted.radius;
  input.color = std::move(reduced.color);
  if (prepared.closing > 0) input.channels = {SurveyedShares(cells, prepared.surveyed())};
  std::vector<std::uint32_t> order;
  level.cloud = BuildCloud(input, nullptr, &order);
  level.normal = Gather(fitted.normal, order);
  level.depth.reserve(order.size());
  for (const std::uint32_t i : order) level.depth.push_back(static_cast<float>(fitted.depth[i]));

  if (!points.photo_begin.empty() && !survey.photographs.empty()) {
    const PhotoRanking ranking(survey, points, cells, options.max_photos_per_metaball);
    const std::size_t blocks = (order.size() + kBlock - 1) / kBlock;
    std::vector<std::vector<std::uint16_t>> photos(blocks);
    std::vector<std::uint32_t> counts(order.size());
    ParallelBlocks(
        order.size(), kBlock,
        [&](std::size_t begin, std::size_t end) {
          std::vector<std::uint16_t> best;
          std::vector<std::uint16_t>& list = photos[begin / kBlock];
          for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t c = order[i];
            ranking.Rank(c, fitted.position[c], fitted.normal[c], &best);
            counts[i] = static_cast<std::uint32_t>(best.size());
            list.insert(list.end(), best.begin(), best.end());
          }
        },
        control, "ranking the photographs", 0.95, 1.0);
    level.photo_begin.reserve(order.size() + 1);
    level.photo_begin.push_back(0);
    for (const std::uint32_t count : counts) {
      level.photo_begin.push_back(level.photo_begin.back() + count);
    }
    level.photo_idx.reserve(level.photo_begin.back());
    for (const auto& list : photos) {
      level.photo_idx.insert(level.photo_idx.end(), list.begin(), list.end());
    }
  }

  LevelStats& stats = level.stats;
  stats.source_points = prepared.source_points;
  stats.outliers = prepared.outliers;
  stats.closing_points = prepared.closing;
  stats.target_count = options.target_count;
  stats.count = level.cloud.size();
  stats.threshold = threshold;
  stats.cloud_bytes = level.cloud.MemoryBytes();
  const auto [smallest, largest] = std::minmax_element(input.radius.begin(), input.radius.end());
  stats.radius_min = *smallest;
  stats.radius_max = *largest;
  stats.radius_median = Median(std::move(input.radius));
  stats.seconds = watch.Seconds();
  control.Report("level built", 1.0);
  return level;
}

}  // namespace sherd
