// Points grouped into a target number of cells. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/control.h"
#include "metaball/vec.h"

namespace sherd {

// The points of cell c are point_idx[cell_begin[c] .. cell_begin[c + 1]).
struct PointCells {
  std::vector<std::uint32_t> cell_begin;  // cells + 1
  std::vector<std::uint32_t> point_idx;   // every point once
  double voxel_size = 0;                  // world units; 0 where there is no grid
  // The point that each cell stands for, of nested levels; empty: the mean of its points.
  std::vector<std::uint32_t> seed;

  std::size_t size() const { return cell_begin.empty() ? 0 : cell_begin.size() - 1; }
};

// The mean of a cell's positions; relative to the first of them, so that nothing is lost far from
// the origin.
Vec3d CentroidOf(const std::vector<Vec3d>& positions, const PointCells& cells, std::size_t cell);

// cell_of: the cell of each point, all below `cells`.
PointCells CellsOf(const std::vector<std::uint32_t>& cell_of, std::uint32_t cells);

// A voxel grid whose voxel size is searched for so that `target` voxels hold points; what the
// search leaves over is merged into neighbours (the emptiest voxels first), what it leaves short is
// made up by splitting the fullest voxels. target >= n: every point by itself. Deterministic, one
// thread. Fast where `positions` (finite) are ordered so that neighbours in space are neighbours in
// memory. Throws Cancelled.
PointCells GroupPoints(const std::vector<Vec3d>& positions, std::uint64_t target,
                       const Control& control = {});

}  // namespace sherd
