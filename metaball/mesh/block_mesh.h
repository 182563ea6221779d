// The part of a mesh inside one block of cells. Internal to metaball/mesh/.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "metaball/mesh/block_list.h"
#include "metaball/mesh/mesh.h"
#include "metaball/mesh/mesh_field.h"

namespace sherd {

// A vertex by the grid edge it lies on, as a triangle of one block names it: the edge's first node
// within the block that owns it, its axis, and whether that block is this one or a next one.
struct VertexRef {
  static constexpr std::uint32_t kEdges = 3u * kBlockCells * kBlockCells * kBlockCells;

  // node: 0..kBlockCells on each axis, of the block that names it.
  static std::uint32_t Of(const std::array<int, 3>& node, int axis) {
    std::uint32_t step = 0, local = 0;
    for (int k = 2; k >= 0; --k) {
      const bool next = node[k] == kBlockCells;
      step = step << 1 | (next ? 1u : 0u);
      local = local * kBlockCells + static_cast<std::uint32_t>(next ? 0 : node[k]);
    }
    return step << 16 | (local * 3 + static_cast<std::uint32_t>(axis));
  }
  static std::uint32_t Step(std::uint32_t ref) { return ref >> 16; }  // bit k: next on axis k
  static std::uint16_t Edge(std::uint32_t ref) { return static_cast<std::uint16_t>(ref); }
};
static_assert(VertexRef::kEdges <= 65536);

struct BlockMesh {
  std::vector<std::uint16_t> edge;  // of each vertex the block owns, ascending
  SurfaceMesh part;                 // triangle: VertexRef
};

// Works on one block after another; one for each thread.
class BlockMesher {
 public:
  // All must outlive this. Blends the channel "uv" where the cloud has one.
  BlockMesher(const MeshField& field, const Cloud& cloud, const BlockList& blocks, double cell);

  BlockMesh Mesh(std::size_t block);

 private:
  static constexpr int kNodes = kBlockCells + 1;
  static std::size_t NodeIndex(int x, int y, int z) {
    return (static_cast<std::size_t>(z) * kNodes + static_cast<std::size_t>(y)) * kNodes +
           static_cast<std::size_t>(x);
  }
  double NodePosition(int axis, int node) const {
    return static_cast<double>(first_[static_cast<std::size_t>(axis)] + node) * cell_;
  }

  void SumOnNodes();
  void AddVertices(BlockMesh* mesh);
  void AddVertex(const std::array<int, 3>& node, int axis, double above_begin, double above_end,
                 BlockMesh* mesh);
  void AddTriangles(BlockMesh* mesh) const;
  // The field above the threshold at a point that `near_` reaches, and its slope along an axis.
  double Above(const Vec3d& p, int axis, double* slope) const;
  void Shade(const Vec3d& p, BlockMesh* mesh) const;

  const MeshField& field_;
  const Cloud& cloud_;
  const BlockList& blocks_;
  const Channel* uv_;
  double cell_;
  std::array<std::int64_t, 3> first_{};  // the block's first node
  std::vector<FieldBall> balls_, near_;
  std::vector<FieldSums> sums_;
  std::vector<double> above_;
};

}  // namespace sherd
