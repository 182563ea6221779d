// The scene's surface: one indexed triangle mesh in double precision, in metres.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "metaball/vec.h"

namespace sherd::synthetic {

struct TriangleMesh {
  std::vector<Vec3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise seen from outside
  std::vector<std::uint16_t> part;                      // one a triangle: index into Scene::parts

  std::uint32_t AddVertex(const Vec3d& p) {
    vertices.push_back(p);
    return static_cast<std::uint32_t>(vertices.size() - 1);
  }
  void AddTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::size_t part_idx) {
    triangles.push_back({a, b, c});
    part.push_back(static_cast<std::uint16_t>(part_idx));
  }
  // A grid of rows x columns vertices that were added row by row from `first` on. Seen from
  // outside, columns run to the right and rows run upwards. `closed`: the last column joins the
  // first one.
  void AddGrid(std::uint32_t first, std::uint32_t rows, std::uint32_t columns, bool closed,
               std::size_t part_idx);

  // Joins a closed ring of `columns` vertices to the one above it, which has one for every `ratio`
  // of them (the first above the first).
  void AddStitch(std::uint32_t fine, std::uint32_t columns, std::uint32_t coarse,
                 std::uint32_t ratio, std::size_t part_idx);

  Vec3d Corner(std::size_t triangle, int k) const {
    return vertices[triangles[triangle][static_cast<std::size_t>(k)]];
  }
};

// Removes the triangles from `first` on that `drop` holds for.
template <class Drop>
void RemoveTriangles(TriangleMesh* mesh, std::size_t first, const Drop& drop) {
  std::size_t kept = first;
  for (std::size_t i = first; i < mesh->triangles.size(); ++i) {
    if (drop(i)) continue;
    mesh->triangles[kept] = mesh->triangles[i];
    mesh->part[kept++] = mesh->part[i];
  }
  mesh->triangles.resize(kept);
  mesh->part.resize(kept);
}

// Area-weighted vertex normals, unit; for shading only.
std::vector<Vec3f> VertexNormals(const TriangleMesh& mesh);

// Moves every coordinate to the nearest single-precision number (by at most 1e-7 m in the trench).
void RoundToSingle(TriangleMesh* mesh);

// Drops the vertices no triangle uses.
void DropUnusedVertices(TriangleMesh* mesh);

}  // namespace sherd::synthetic
