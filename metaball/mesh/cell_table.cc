#include "metaball/mesh/cell_table.h"

#include <vector>

#include "metaball/error.h"

namespace sherd {

const std::array<CellEdge, 12> kCellEdges = {{{0, 0},
                                              {2, 0},
                                              {4, 0},
                                              {6, 0},
                                              {0, 1},
                                              {1, 1},
                                              {4, 1},
                                              {5, 1},
                                              {0, 2},
                                              {1, 2},
                                              {2, 2},
                                              {3, 2}}};

namespace {

using Loop = std::vector<std::uint8_t>;  // edges in order

std::uint8_t EdgeBetween(int a, int b) {
  const int begin = a < b ? a : b;
  for (std::uint8_t e = 0; e < 12; ++e) {
    if (kCellEdges[e].corner == begin && (begin | 1 << kCellEdges[e].axis) == (a < b ? b : a)) {
      return e;
    }
  }
  throw Error("two corners of a cell without an edge between them");
}

// The corners of the face at the low or high end of an axis, counter-clockwise seen from outside.
std::array<int, 4> FaceCorners(int axis, bool high) {
  const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
  const int base = high ? 1 << axis : 0;
  if (high) return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

// Bits of the two faces an edge lies in.
int FacesOf(std::uint8_t edge) {
  const auto [corner, axis] = kCellEdges[edge];
  int faces = 0;
  for (int a = 0; a < 3; ++a) {
    if (a != axis) faces |= 1 << (2 * a + (corner >> a & 1));
  }
  return faces;
}

// On each face a segment leads from where a run of inside corners begins to where it ends. A
// neighbouring face walks their common edge the other way round, so segments join head to tail.
// The loops run counter-clockwise seen from outside the surface.
std::vector<Loop> LoopsOf(std::uint8_t inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> corners = FaceCorners(face / 2, face % 2 == 1);
    const auto is_inside = [&](int k) { return (inside >> corners[k & 3] & 1) != 0; };
    for (int k = 0; k < 4; ++k) {
      if (!is_inside(k) || is_inside(k + 3)) continue;
      int last = k;
      while (is_inside(last + 1)) ++last;
      next[EdgeBetween(corners[(k + 3) & 3], corners[k])] =
          EdgeBetween(corners[last & 3], corners[(last + 1) & 3]);
    }
  }
  std::vector<Loop> loops;
  for (int start = 0; start < 12; ++start) {
    Loop loop;
    for (int e = start; next[e] >= 0;) {
      loop.push_back(static_cast<std::uint8_t>(e));
      const int following = next[e];
      next[e] = -1;
      e = following;
    }
    if (!loop.empty()) loops.push_back(std::move(loop));
  }
  return loops;
}

// Cuts the part [begin, end] of a loop into triangles whose inner edges lie in no face; false where
// that cannot be done. The side from begin to end is given.
bool Triangulate(const Loop& loop, std::size_t begin, std::size_t end, CellTriangles* out) {
  if (end - begin < 2) return true;
  for (std::size_t k = begin + 1; k < end; ++k) {
    const bool left_is_inner = k - begin > 1, right_is_inner = end - k > 1;
    if (left_is_inner && (FacesOf(loop[begin]) & FacesOf(loop[k]))) continue;
    if (right_is_inner && (FacesOf(loop[k]) & FacesOf(loop[end]))) continue;
    const int before = out->count;
    if (before == CellTriangles::kMost) return false;
    out->edges[static_cast<std::size_t>(out->count++)] = {loop[begin], loop[k], loop[end]};
    if (Triangulate(loop, begin, k, out) && Triangulate(loop, k, end, out)) return true;
    out->count = before;
  }
  return false;
}

std::array<CellTriangles, 256> MakeTable() {
  std::array<CellTriangles, 256> table;
  for (int inside = 0; inside < 256; ++inside) {
    CellTriangles& cell = table[static_cast<std::size_t>(inside)];
    for (const Loop& loop : LoopsOf(static_cast<std::uint8_t>(inside))) {
      // No loop of the 256 cases fails (tests/metaball/mesh_test.cc).
      if (!Triangulate(loop, 0, loop.size() - 1, &cell)) throw Error("a cell without triangles");
    }
  }
  return table;
}

}  // namespace

const CellTriangles& TrianglesOfCell(std::uint8_t inside) {
  static const std::array<CellTriangles, 256> table = MakeTable();
  return table[inside];
}

}  // namespace sherd
