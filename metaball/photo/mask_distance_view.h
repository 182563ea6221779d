// How far the places of a photograph are from what its mask ignores, on the CPU and on the GPU.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include "metaball/hostdevice.h"

namespace sherd {

// Distances to the nearest black pixel on a grid of cells over the original.
struct MaskDistanceView {
  int columns = 1, rows = 1;
  double cells_per_px_x = 1, cells_per_px_y = 1;
  double cell_px = 1;  // the shorter side
  // From centre to centre of cells, in quarters of a cell, row-major; a cell with a black pixel is
  // black. Null: nothing is.
  const std::uint8_t* quarters = nullptr;

  std::size_t cells() const { return static_cast<std::size_t>(columns) * rows; }

  // From (x, y), pixels of the original, in the picture: never more than it is, and less by at most
  // four cells, save that nothing above 62 cells is told. 0 on a black pixel; infinity where there
  // is none.
  SHERD_HD double At(double x, double y) const {
    if (!quarters) return std::numeric_limits<double>::infinity();
    x = std::clamp(x * cells_per_px_x - 0.5, 0.0, static_cast<double>(columns - 1));
    y = std::clamp(y * cells_per_px_y - 0.5, 0.0, static_cast<double>(rows - 1));
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const int x1 = std::min(x0 + 1, columns - 1), y1 = std::min(y0 + 1, rows - 1);
    const double fx = x - x0, fy = y - y0;
    const double top = CellsAt(x0, y0) * (1 - fx) + CellsAt(x1, y0) * fx;
    const double bottom = CellsAt(x0, y1) * (1 - fx) + CellsAt(x1, y1) * fx;
    // Half a cell's diagonal for where in the black cell its pixel lies, and as much for where
    // between the centres the place does.
    const double cells = top * (1 - fy) + bottom * fy - std::numbers::sqrt2;
    return std::max(0.0, cells) * cell_px;
  }

 private:
  SHERD_HD double CellsAt(int column, int row) const {
    return quarters[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                    static_cast<std::size_t>(column)] /
           4.0;
  }
};

}  // namespace sherd
