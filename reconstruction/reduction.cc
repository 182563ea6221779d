#include "reconstruction/reduction.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "metaball/error.h"
#include "metaball/median.h"
#include "reconstruction/neighbors.h"
#include "reconstruction/parallel.h"
#include "reconstruction/point_arrays.h"
#include "reconstruction/sample_elimination.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr std::uint64_t kCandidates = 4;  // a metaball that is wanted
constexpr double kMostStretch = 2.0;      // finer or coarser than the mean spacing
constexpr int kBendNeighbors = 16;

// What elimination chooses from: one for each cell, or each point where there are no cells.
struct Candidates {
  Samples samples;
  std::vector<Vec3f> normal;  // where the reduction asks for them
};

Candidates CandidatesOf(const PreparedPoints& prepared, const PointCells* cells, bool normals) {
  const SurveyPoints& points = prepared.points;
  // A lone point does not stand for a whole field.
  const float most = 3 * Median(prepared.spacing);
  const auto area = [&](std::size_t i) {
    const double spacing = std::min(prepared.spacing[i], most);
    return spacing * spacing;
  };
  Candidates out;
  if (!cells) {
    out.samples.position = points.position;
    if (normals) out.normal = points.normal;
    out.samples.area.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) out.samples.area[i] = area(i);
    return out;
  }
  const std::size_t n = cells->size();
  out.samples.position.resize(n);
  out.samples.area.assign(n, 0.0);
  if (normals) out.normal.resize(n);
  for (std::size_t c = 0; c < n; ++c) {
    const std::uint32_t first = cells->point_idx[cells->cell_begin[c]];
    Vec3f normal{};
    for (std::uint32_t j = cells->cell_begin[c]; j < cells->cell_begin[c + 1]; ++j) {
      const std::uint32_t i = cells->point_idx[j];
      normal += points.normal[i];
      out.samples.area[c] += area(i);
    }
    out.samples.position[c] = CentroidOf(points.position, *cells, c);
    if (normals) out.normal[c] = Normalized(normal, points.normal[first]);
  }
  return out;
}

// 1 / sqrt(curvature), relative to the median and within bounds. The normals around are averaged
// first, which leaves the bend and takes most of their noise.
std::vector<float> StretchOf(const Candidates& candidates, const Control& control) {
  const std::size_t n = candidates.samples.position.size();
  const NeighborSearch search(candidates.samples.position);
  std::vector<Vec3f> mean(n);
  std::vector<float> bend(n);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kBendNeighbors];
        float distance[kBendNeighbors];
        for (std::size_t i = begin; i < end; ++i) {
          const int count = search.Nearest(i, kBendNeighbors / 2, idx, distance);
          Vec3f sum{};
          for (int k = 0; k < count; ++k) {
            const Vec3f& normal = candidates.normal[static_cast<std::size_t>(idx[k])];
            if (Dot(normal, candidates.normal[i]) > 0) sum += normal;
          }
          mean[i] = Normalized(sum, candidates.normal[i]);
        }
      },
      control);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kBendNeighbors];
        float distance[kBendNeighbors];
        for (std::size_t i = begin; i < end; ++i) {
          const int count = search.Nearest(i, kBendNeighbors, idx, distance);
          double turn = 0, way = 0;
          for (int k = 0; k < count; ++k) {
            const Vec3f d = mean[static_cast<std::size_t>(idx[k])] - mean[i];
            turn += static_cast<double>(Dot(d, d));
            way += static_cast<double>(distance[k]) * static_cast<double>(distance[k]);
          }
          bend[i] = way > 0 ? static_cast<float>(std::sqrt(turn / way)) : 0.0f;
        }
      },
      control);
  const float typical = Median(bend);
  std::vector<float> stretch(n, 1.0f);
  if (!(typical > 0)) return stretch;
  for (std::size_t i = 0; i < n; ++i) {
    const double relative = std::sqrt(typical / std::max(bend[i], 1e-6f * typical));
    stretch[i] = static_cast<float>(std::clamp(relative, 1 / kMostStretch, kMostStretch));
  }
  return stretch;
}

Samples SamplesOf(const PreparedPoints& prepared, const PointCells* cells, Reduction reduction,
                  const Control& control) {
  const bool adaptive = reduction == Reduction::kAdaptive;
  Candidates candidates = CandidatesOf(prepared, cells, adaptive);
  if (adaptive) candidates.samples.stretch = StretchOf(candidates, control);
  return std::move(candidates.samples);
}

// For each of `position` the nearest of `centers`.
std::vector<std::uint32_t> NearestOf(const std::vector<Vec3d>& position,
                                     const std::vector<Vec3d>& centers, const Control& control) {
  const NeighborSearch search(centers);
  std::vector<std::uint32_t> out(position.size());
  ParallelBlocks(
      position.size(), kBlock,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          out[i] = static_cast<std::uint32_t>(search.NearestTo(position[i]));
        }
      },
      control);
  return out;
}

// The cells of `grid`, which are never taken apart, joined: cell c becomes part of joined[c].
PointCells Join(const PointCells& grid, const std::vector<std::uint32_t>& joined,
                std::size_t cells) {
  PointCells out;
  out.cell_begin.assign(cells + 1, 0);
  for (std::size_t c = 0; c < grid.size(); ++c) {
    out.cell_begin[joined[c] + 1] += grid.cell_begin[c + 1] - grid.cell_begin[c];
  }
  std::partial_sum(out.cell_begin.begin(), out.cell_begin.end(), out.cell_begin.begin());
  out.point_idx.resize(grid.point_idx.size());
  std::vector<std::uint32_t> next(out.cell_begin.begin(), out.cell_begin.end() - 1);
  for (std::size_t c = 0; c < grid.size(); ++c) {
    for (std::uint32_t j = grid.cell_begin[c]; j < grid.cell_begin[c + 1]; ++j) {
      out.point_idx[next[joined[c]]++] = grid.point_idx[j];
    }
  }
  for (std::size_t k = 0; k < cells; ++k) {
    std::sort(out.point_idx.begin() + out.cell_begin[k],
              out.point_idx.begin() + out.cell_begin[k + 1]);
  }
  return out;
}

PointCells ReduceEvenly(const PreparedPoints& prepared, std::uint64_t target, Reduction reduction,
                        const Control& control) {
  const std::size_t n = prepared.points.size();
  PointCells grid;
  const bool gridded = n / kCandidates > target;
  if (gridded) grid = GroupPoints(prepared.points.position, kCandidates * target, control);
  std::vector<std::uint32_t> joined;  // what each candidate becomes part of
  {
    const Samples samples = SamplesOf(prepared, gridded ? &grid : nullptr, reduction, control);
    const std::vector<std::uint32_t> kept = EliminateSamples(samples, target, control);
    joined = NearestOf(samples.position, Gather(samples.position, kept), control);
    // Where candidates coincide the nearest may be another: every one that stays is its own.
    for (std::size_t k = 0; k < kept.size(); ++k) joined[kept[k]] = static_cast<std::uint32_t>(k);
  }
  const auto cells = static_cast<std::uint32_t>(target);
  return gridded ? Join(grid, joined, cells) : CellsOf(joined, cells);
}

PointCells TakeFirst(const PreparedPoints& prepared, std::uint64_t target, const Control& control) {
  std::vector<std::uint32_t> seed(prepared.order.begin(),
                                  prepared.order.begin() + static_cast<std::ptrdiff_t>(target));
  std::sort(seed.begin(), seed.end());
  std::vector<std::uint32_t> cell_of =
      NearestOf(prepared.points.position, Gather(prepared.points.position, seed), control);
  for (std::size_t k = 0; k < seed.size(); ++k) cell_of[seed[k]] = static_cast<std::uint32_t>(k);
  PointCells cells = CellsOf(cell_of, static_cast<std::uint32_t>(seed.size()));
  cells.seed = std::move(seed);
  return cells;
}

}  // namespace

void OrderPoints(Reduction reduction, PreparedPoints* points, const Control& control) {
  if (reduction == Reduction::kVoxel) {
    throw InputError("", "", "levels reduced by voxels do not nest",
                     "take --reduction blue-noise or adaptive for nested levels");
  }
  control.Report("ordering the points", 0.0);
  points->order = EliminationOrder(SamplesOf(*points, nullptr, reduction, control), control);
  points->ordered_for = reduction;
}

PointCells ReducePoints(const PreparedPoints& points, const LevelOptions& options,
                        const Control& control) {
  const std::uint64_t target = std::min<std::uint64_t>(options.target_count, points.points.size());
  if (options.nested) {
    if (points.order.size() != points.points.size() || points.ordered_for != options.reduction) {
      throw InputError("", "", "nested levels need their points in order");
    }
    return TakeFirst(points, target, control);
  }
  if (options.reduction == Reduction::kVoxel || target == points.points.size()) {
    return GroupPoints(points.points.position, target, control);
  }
  return ReduceEvenly(points, target, options.reduction, control);
}

}  // namespace sherd
