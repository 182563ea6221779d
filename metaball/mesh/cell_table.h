// How a surface passes through one cubic cell: the cases of marching cubes, computed, not typed in.
// Internal to metaball/mesh/.
//
// Corner c of a cell has the coordinates (c & 1, c >> 1 & 1, c >> 2 & 1). Edge e begins at the
// corner kCellEdges[e].corner and runs along its axis. On every face each run of inside corners is
// cut off by one segment, so that two cells agree on their common face whatever the rest of them
// is: the surface has no cracks. The segments join to loops, which are cut into triangles none of
// whose inner edges lies in a face: two cells never share one of these.
#pragma once

#include <array>
#include <cstdint>

namespace sherd {

struct CellEdge {
  std::uint8_t corner, axis;
};
// Axis x: 0..3, y: 4..7, z: 8..11.
extern const std::array<CellEdge, 12> kCellEdges;

struct CellTriangles {
  static constexpr int kMost = 5;
  int count = 0;
  // The edges whose crossings are the corners, counter-clockwise seen from outside.
  std::array<std::array<std::uint8_t, 3>, kMost> edges{};
};

// The triangles where bit c of `inside` says whether corner c is inside. Computed once,
// thread-safe.
const CellTriangles& TrianglesOfCell(std::uint8_t inside);

}  // namespace sherd
