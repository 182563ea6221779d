#include "datasets_synthetic/triangle_mesh.h"

#include <limits>

namespace sherd::synthetic {

void TriangleMesh::AddGrid(std::uint32_t first, std::uint32_t rows, std::uint32_t columns,
                           bool closed, std::size_t part_idx) {
  const std::uint32_t spans = closed ? columns : columns - 1;
  for (std::uint32_t r = 0; r + 1 < rows; ++r) {
    for (std::uint32_t c = 0; c < spans; ++c) {
      const std::uint32_t next = (c + 1) % columns;
      const std::uint32_t a = first + r * columns + c, b = first + r * columns + next;
      const std::uint32_t d = a + columns, e = b + columns;
      // The shorter diagonal: follows ridges and pit edges better than a fixed one.
      const Vec3d ae = vertices[e] - vertices[a], bd = vertices[d] - vertices[b];
      if (Dot(ae, ae) <= Dot(bd, bd)) {
        AddTriangle(a, b, e, part_idx);
        AddTriangle(a, e, d, part_idx);
      } else {
        AddTriangle(a, b, d, part_idx);
        AddTriangle(b, e, d, part_idx);
      }
    }
  }
}

void TriangleMesh::AddStitch(std::uint32_t fine, std::uint32_t columns, std::uint32_t coarse,
                             std::uint32_t ratio, std::size_t part_idx) {
  const std::uint32_t coarse_columns = columns / ratio;
  for (std::uint32_t c = 0; c < coarse_columns; ++c) {
    const std::uint32_t left = coarse + c, right = coarse + (c + 1) % coarse_columns;
    const auto at = [&](std::uint32_t k) { return fine + (c * ratio + k) % columns; };
    // The lower edges' left half belongs to the left vertex above, the right half to the right one.
    for (std::uint32_t k = 0; k < ratio; ++k) {
      AddTriangle(at(k), at(k + 1), k < ratio / 2 ? left : right, part_idx);
    }
    AddTriangle(at(ratio / 2), right, left, part_idx);
  }
}

std::vector<Vec3f> VertexNormals(const TriangleMesh& mesh) {
  std::vector<Vec3d> sum(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    const Vec3d a = mesh.vertices[t[0]];
    const Vec3d n = Cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
    for (const std::uint32_t v : t) sum[v] += n;
  }
  std::vector<Vec3f> normals(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i) normals[i] = Normalized(sum[i]).cast<float>();
  return normals;
}

void RoundToSingle(TriangleMesh* mesh) {
  for (Vec3d& v : mesh->vertices) v = v.cast<float>().cast<double>();
}

void DropUnusedVertices(TriangleMesh* mesh) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> renamed(mesh->vertices.size(), kUnused);
  std::vector<Vec3d> kept;
  for (auto& t : mesh->triangles) {
    for (std::uint32_t& v : t) {
      if (renamed[v] == kUnused) {
        renamed[v] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(mesh->vertices[v]);
      }
      v = renamed[v];
    }
  }
  mesh->vertices = std::move(kept);
}

}  // namespace sherd::synthetic
