#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>

#include "metaball/error.h"
#include "metaball/median.h"
#include "metaball/mesh/block_list.h"
#include "metaball/mesh/block_mesh.h"
#include "metaball/mesh/mesh.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

// Reports how much of `count` pieces is done, from any thread, one call at a time.
class Counter {
 public:
  Counter(const Control& control, const char* what, std::size_t count, double from, double to)
      : control_(control), what_(what), count_(count), from_(from), to_(to) {}
  void Done() {
    control_.ThrowIfStopped();
    const std::lock_guard lock(mutex_);
    ++done_;
    if (done_ % 64 != 0 && done_ != count_) return;
    const double share = static_cast<double>(done_) / static_cast<double>(count_);
    control_.Report(what_, from_ + (to_ - from_) * share);
  }

 private:
  const Control& control_;
  const char* what_;
  std::size_t count_, done_ = 0;
  double from_, to_;
  std::mutex mutex_;
};

// Where each block's vertices and triangles begin in the whole mesh.
struct Offsets {
  std::vector<std::size_t> vertex, triangle;
};

Offsets OffsetsOf(const std::vector<BlockMesh>& parts) {
  Offsets offsets;
  std::size_t vertices = 0, triangles = 0;
  for (const BlockMesh& mesh : parts) {
    offsets.vertex.push_back(vertices);
    offsets.triangle.push_back(triangles);
    vertices += mesh.edge.size();
    triangles += mesh.part.triangle.size();
  }
  offsets.vertex.push_back(vertices);
  offsets.triangle.push_back(triangles);
  return offsets;
}

// Moves one block's part to its place in the whole mesh; its triangles get their indices.
void Place(const BlockList& blocks, const std::vector<BlockMesh>& parts, const Offsets& offsets,
           std::size_t block, SurfaceMesh* mesh) {
  const SurfaceMesh& part = parts[block].part;
  const auto at = static_cast<std::ptrdiff_t>(offsets.vertex[block]);
  std::copy(part.position.begin(), part.position.end(), mesh->position.begin() + at);
  std::copy(part.normal.begin(), part.normal.end(), mesh->normal.begin() + at);
  std::copy(part.color.begin(), part.color.end(), mesh->color.begin() + at);
  if (!mesh->uv.empty()) std::copy(part.uv.begin(), part.uv.end(), mesh->uv.begin() + at);
  if (part.triangle.empty()) return;
  std::array<std::int64_t, 8> owner;
  for (int step = 0; step < 8; ++step) {
    owner[static_cast<std::size_t>(step)] =
        blocks.Neighbor(block, {step & 1, step >> 1 & 1, step >> 2 & 1});
  }
  std::size_t next = offsets.triangle[block];
  for (const auto& refs : part.triangle) {
    std::array<std::uint32_t, 3> triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      // The owner exists: a crossing means a support that reaches the edge, and so its block.
      const auto own = static_cast<std::size_t>(owner[VertexRef::Step(refs[k])]);
      const auto& edges = parts[own].edge;
      const auto found = std::lower_bound(edges.begin(), edges.end(), VertexRef::Edge(refs[k]));
      triangle[k] = static_cast<std::uint32_t>(offsets.vertex[own] +
                                               static_cast<std::size_t>(found - edges.begin()));
    }
    mesh->triangle[next++] = triangle;
  }
}

}  // namespace

double DefaultCellSize(const Scene& scene) {
  const Cloud& cloud = *scene.cloud;
  if (cloud.empty()) return 1.0;
  const double radius = cloud.radius.empty() ? cloud.uniform_radius : Median(cloud.radius);
  return 0.5 * radius * scene.surface.radius_scale * cloud.frame.unit;
}

SurfaceMesh ExtractMesh(const Scene& scene, const MeshOptions& options, const Control& control) {
  const Cloud& cloud = *scene.cloud;
  const MeshField field(scene);
  const double size = options.cell_size == 0 ? DefaultCellSize(scene) : options.cell_size;
  if (!(size > 0) || !std::isfinite(size)) {
    throw Error("the cell size must be positive and finite");
  }
  if (cloud.empty()) return {};
  const double cell = size / cloud.frame.unit;
  control.Report("sorting metaballs into blocks", 0);
  const BlockList blocks(field, cloud, cell, control);

  std::vector<BlockMesh> parts(blocks.size());
  std::vector<std::unique_ptr<BlockMesher>> meshers(
      static_cast<std::size_t>(ThreadCount(options.threads)));
  const auto count = static_cast<std::int64_t>(blocks.size());
  Counter meshing(control, "extracting the surface", blocks.size(), 0.1, 0.9);
  ParallelFor(count, options.threads, [&](std::int64_t block, int worker) {
    auto& mesher = meshers[static_cast<std::size_t>(worker)];
    if (!mesher) mesher = std::make_unique<BlockMesher>(field, cloud, blocks, cell);
    parts[static_cast<std::size_t>(block)] = mesher->Mesh(static_cast<std::size_t>(block));
    meshing.Done();
  });

  const Offsets offsets = OffsetsOf(parts);
  // PLY files count vertices with signed numbers.
  if (offsets.vertex.back() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    throw Error("the mesh would have " + std::to_string(offsets.vertex.back()) +
                " vertices, more than can be counted; choose a larger cell");
  }
  SurfaceMesh mesh;
  mesh.position.resize(offsets.vertex.back());
  mesh.normal.resize(offsets.vertex.back());
  mesh.color.resize(offsets.vertex.back());
  const Channel* const uv = cloud.FindChannel("uv");
  if (uv && uv->components() >= 2) mesh.uv.resize(offsets.vertex.back());
  mesh.triangle.resize(offsets.triangle.back());
  Counter joining(control, "joining the blocks", blocks.size(), 0.9, 1);
  ParallelFor(count, options.threads, [&](std::int64_t block, int) {
    Place(blocks, parts, offsets, static_cast<std::size_t>(block), &mesh);
    joining.Done();
  });
  return mesh;
}

}  // namespace sherd
