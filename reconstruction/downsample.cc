#include "reconstruction/downsample.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "reconstruction/neighbors.h"
#include "reconstruction/survey.h"

namespace sherd {
namespace {

constexpr std::uint32_t kNone = UINT32_MAX;

std::uint64_t Mixed(std::uint64_t x) {  // splitmix64's finaliser: a bijection
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

struct VoxelIndex {
  std::int64_t x = 0, y = 0, z = 0;
  friend bool operator==(const VoxelIndex&, const VoxelIndex&) = default;
};

class Grid {
 public:
  Grid(const Vec3d& origin, double voxel_size) : origin_(origin), inverse_(1.0 / voxel_size) {}
  VoxelIndex At(const Vec3d& p) const {
    const Vec3d q = (p - origin_) * inverse_;
    return {static_cast<std::int64_t>(q.x), static_cast<std::int64_t>(q.y),
            static_cast<std::int64_t>(q.z)};  // q >= 0: truncation is floor
  }
  // 64 bits of the three indices. Different voxels may share a key, once in 10^5 clouds of 10^7
  // points: whoever needs to be right compares the indices as well.
  static std::uint64_t Key(const VoxelIndex& v) {
    return Mixed(static_cast<std::uint64_t>(v.x) * 0x9e3779b97f4a7c15ull +
                 Mixed(static_cast<std::uint64_t>(v.y) * 0xc2b2ae3d27d4eb4full +
                       Mixed(static_cast<std::uint64_t>(v.z) + 0x165667b19e3779f9ull)));
  }

 private:
  Vec3d origin_;
  double inverse_;
};

std::size_t TableSize(std::uint64_t entries) {
  std::size_t size = 16;
  while (size < 2 * entries) size *= 2;
  return size;
}

// How many voxels hold points; stops at `limit`.
class VoxelCounter {
 public:
  VoxelCounter(const std::vector<Vec3d>& positions, std::uint64_t limit)
      : positions_(positions),
        limit_(std::min<std::uint64_t>(limit, positions.size())),
        table_(TableSize(limit_ + 1)) {}

  std::uint64_t Count(const Grid& grid, const Control& control) {
    std::fill(table_.begin(), table_.end(), 0);
    const std::size_t mask = table_.size() - 1;
    std::uint64_t count = 0, last = 0;
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      if (i % (1 << 18) == 0) control.ThrowIfStopped();
      std::uint64_t key = Grid::Key(grid.At(positions_[i]));
      key += key == 0;  // 0 marks an empty slot
      if (key == last) continue;
      last = key;
      std::size_t slot = key & mask;
      while (table_[slot] != 0 && table_[slot] != key) slot = (slot + 1) & mask;
      if (table_[slot] == key) continue;
      table_[slot] = key;
      if (++count >= limit_) return count;
    }
    return count;
  }

 private:
  const std::vector<Vec3d>& positions_;
  std::uint64_t limit_;
  std::vector<std::uint64_t> table_;
};

// The voxel of each point, numbered in the order of first appearance. Returns their number.
std::uint32_t AssignVoxels(const std::vector<Vec3d>& positions, const Grid& grid,
                           std::uint64_t expected, std::vector<std::uint32_t>* voxel_of) {
  struct Slot {
    std::uint64_t key;
    std::uint32_t voxel = kNone;
    std::uint32_t first_point = 0;
  };
  std::vector<Slot> table(TableSize(expected + 1));
  const std::size_t mask = table.size() - 1;
  std::uint32_t voxels = 0;
  voxel_of->resize(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const VoxelIndex voxel = grid.At(positions[i]);
    const std::uint64_t key = Grid::Key(voxel);
    std::size_t slot = key & mask;
    while (table[slot].voxel != kNone &&
           !(table[slot].key == key && grid.At(positions[table[slot].first_point]) == voxel)) {
      slot = (slot + 1) & mask;
    }
    if (table[slot].voxel == kNone) table[slot] = {key, voxels++, static_cast<std::uint32_t>(i)};
    (*voxel_of)[i] = table[slot].voxel;
  }
  return voxels;
}

// Merges `excess` cells, the emptiest first, into their nearest neighbour that stays.
void MergeExcess(const std::vector<Vec3d>& positions, std::uint64_t excess, std::uint32_t* cells,
                 std::vector<std::uint32_t>* cell_of) {
  std::vector<std::uint32_t> population(*cells, 0);
  std::vector<Vec3d> center(*cells);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    ++population[(*cell_of)[i]];
    center[(*cell_of)[i]] += positions[i];
  }
  for (std::uint32_t c = 0; c < *cells; ++c) center[c] = center[c] / double(population[c]);
  // Among equally empty ones a scattered choice, so that no region is thinned more than another.
  std::vector<std::uint32_t> order(*cells);
  std::iota(order.begin(), order.end(), 0u);
  const auto emptier = [&](std::uint32_t a, std::uint32_t b) {
    if (population[a] != population[b]) return population[a] < population[b];
    return Mixed(a + 1) < Mixed(b + 1);
  };
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(excess), order.end(),
                   emptier);
  std::vector<bool> goes(*cells, false);
  for (std::uint64_t i = 0; i < excess; ++i) goes[order[i]] = true;

  const NeighborSearch search(center);
  std::vector<std::uint32_t> target(*cells);
  std::iota(target.begin(), target.end(), 0u);
  std::vector<int> idx;
  std::vector<float> distance;
  for (std::uint32_t c = 0; c < *cells; ++c) {
    if (!goes[c]) continue;
    for (std::uint32_t k = 8;; k *= 8) {
      k = std::min(k, *cells);
      idx.resize(k);
      distance.resize(k);
      const int found = search.Nearest(c, static_cast<int>(k), idx.data(), distance.data());
      const auto stays = std::find_if(idx.begin(), idx.begin() + found,
                                      [&](int j) { return !goes[static_cast<std::size_t>(j)]; });
      if (stays != idx.begin() + found) {
        target[c] = static_cast<std::uint32_t>(*stays);
        break;
      }
      if (k == *cells) break;  // nothing stays: cannot be, excess < cells
    }
  }
  std::vector<std::uint32_t> number(*cells, kNone);
  std::uint32_t left = 0;
  for (std::uint32_t c = 0; c < *cells; ++c) {
    if (!goes[c]) number[c] = left++;
  }
  for (std::uint32_t& c : *cell_of) c = number[target[c]];
  *cells = left;
}

// Splits the fullest cells in two (by the order of their points) until there are `target`.
void SplitFullest(std::uint64_t target, std::uint32_t* cells, std::vector<std::uint32_t>* cell_of) {
  while (*cells < target) {
    std::vector<std::uint32_t> population(*cells, 0);
    for (const std::uint32_t c : *cell_of) ++population[c];
    std::vector<std::uint32_t> order(*cells);
    std::iota(order.begin(), order.end(), 0u);
    const std::uint64_t wanted = std::min<std::uint64_t>(target - *cells, *cells);
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(wanted),
                      order.end(), [&](std::uint32_t a, std::uint32_t b) {
                        return population[a] != population[b] ? population[a] > population[b]
                                                              : a < b;
                      });
    std::vector<std::uint32_t> second(*cells, kNone), seen(*cells, 0);
    std::uint32_t next = *cells;
    for (std::uint64_t i = 0; i < wanted && population[order[i]] > 1; ++i) {
      second[order[i]] = next++;
    }
    if (next == *cells) return;  // every cell holds one point
    for (std::uint32_t& c : *cell_of) {
      const std::uint32_t old = c;
      if (second[old] != kNone && seen[old] >= population[old] / 2) c = second[old];
      ++seen[old];
    }
    *cells = next;
  }
}

struct VoxelSize {
  double size = 0;          // 0: none gives as many voxels as are wanted
  std::uint64_t count = 0;  // of voxels that hold points
  double finest = 0;        // that was thought of
};

// The largest voxel that still gives at least `target` of them. The count falls roughly with the
// square of the size (points lie on surfaces), so each step aims by that law and the bracket guards
// it.
VoxelSize FindVoxelSize(const std::vector<Vec3d>& positions, const Vec3d& min, double extent,
                        std::uint64_t target, const Control& control) {
  double fine = extent * 0x1p-48, coarse = extent * 1.0001;  // too many; one voxel
  VoxelSize best;
  const Box3d box = RobustBounds(positions);
  VoxelCounter counter(positions, 4 * target + 16);
  double voxel = std::clamp(box.Diagonal() / std::sqrt(static_cast<double>(target)), fine, coarse);
  for (int step = 0; step < 60; ++step) {
    const std::uint64_t count = counter.Count(Grid(min, voxel), control);
    if (count >= target) {
      fine = voxel;
      if (best.count == 0 || count <= best.count) {
        best.size = voxel;
        best.count = count;
      }
      if (count - target <= target / 500) break;
    } else {
      coarse = voxel;
    }
    if (coarse / fine < 1 + 1e-7) break;
    const double aimed =
        voxel * std::sqrt(static_cast<double>(count) / (static_cast<double>(target) * 1.001));
    // Away from the ends of the bracket, so that it shrinks also where the law does not hold.
    const double ratio = std::pow(coarse / fine, 0.02);
    voxel = aimed > fine * ratio && aimed < coarse / ratio && step % 4 != 3
                ? aimed
                : std::sqrt(fine * coarse);
  }
  best.finest = fine;
  return best;
}

}  // namespace

Vec3d CentroidOf(const std::vector<Vec3d>& positions, const PointCells& cells, std::size_t cell) {
  const std::uint32_t begin = cells.cell_begin[cell], end = cells.cell_begin[cell + 1];
  const Vec3d base = positions[cells.point_idx[begin]];
  Vec3d offset{};
  for (std::uint32_t j = begin; j < end; ++j) offset += positions[cells.point_idx[j]] - base;
  return base + offset / static_cast<double>(end - begin);
}

PointCells CellsOf(const std::vector<std::uint32_t>& cell_of, std::uint32_t cells) {
  PointCells out;
  out.cell_begin.assign(std::size_t{cells} + 1, 0);
  for (const std::uint32_t c : cell_of) ++out.cell_begin[c + 1];
  std::partial_sum(out.cell_begin.begin(), out.cell_begin.end(), out.cell_begin.begin());
  out.point_idx.resize(cell_of.size());
  std::vector<std::uint32_t> next(out.cell_begin.begin(), out.cell_begin.end() - 1);
  for (std::size_t i = 0; i < cell_of.size(); ++i) {
    out.point_idx[next[cell_of[i]]++] = static_cast<std::uint32_t>(i);
  }
  return out;
}

PointCells GroupPoints(const std::vector<Vec3d>& positions, std::uint64_t target,
                       const Control& control) {
  const std::size_t n = positions.size();
  if (target >= n) {
    PointCells out;
    out.cell_begin.resize(n + 1);
    std::iota(out.cell_begin.begin(), out.cell_begin.end(), 0u);
    out.point_idx.resize(n);
    std::iota(out.point_idx.begin(), out.point_idx.end(), 0u);
    return out;
  }
  Vec3d min = positions[0], max = positions[0];
  for (const Vec3d& p : positions) {
    min = {std::min(min.x, p.x), std::min(min.y, p.y), std::min(min.z, p.z)};
    max = {std::max(max.x, p.x), std::max(max.y, p.y), std::max(max.z, p.z)};
  }
  const Vec3d size = max - min;
  const double extent = std::max({size.x, size.y, size.z});

  const VoxelSize best = extent > 0 && std::isfinite(extent)
                             ? FindVoxelSize(positions, min, extent, target, control)
                             : VoxelSize{};
  std::vector<std::uint32_t> cell_of;
  std::uint32_t cells;
  if (best.size > 0) {
    // Counted up to the counter's limit; the assignment has room for more.
    cells = AssignVoxels(positions, Grid(min, best.size),
                         best.count >= 4 * target ? n : best.count + best.count / 8, &cell_of);
  } else {
    cell_of.assign(n, 0);  // fewer distinct positions than wanted
    cells = best.finest > 0 ? AssignVoxels(positions, Grid(min, best.finest), n, &cell_of) : 1;
  }
  control.ThrowIfStopped();
  if (cells > target) MergeExcess(positions, cells - target, &cells, &cell_of);
  if (cells < target) SplitFullest(target, &cells, &cell_of);
  PointCells out = CellsOf(cell_of, cells);
  out.voxel_size = best.size;
  return out;
}

}  // namespace sherd
