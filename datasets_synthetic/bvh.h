// Exact nearest hit and exact nearest distance on a triangle mesh: a four-wide hierarchy of boxes.
// Boxes are tested in single precision and are a little too large; triangles are tested in double
// precision.
#pragma once

#include <cstdint>
#include <vector>

#include "datasets_synthetic/triangle_mesh.h"
#include "metaball/camera.h"

namespace sherd::synthetic {

struct MeshHit {
  double distance = 0;         // along the ray's unit direction
  double u = 0, v = 0;         // barycentric weights of the triangle's second and third corner
  std::uint32_t triangle = 0;  // index into TriangleMesh::triangles
};

class Bvh {
 public:
  // The mesh must lie within 100 m of the origin (the boxes' margin covers the rounding of that),
  // on coordinates that are representable in single precision (RoundToSingle).
  explicit Bvh(const TriangleMesh& mesh);

  // The nearest hit at a distance in (0, max_distance). Both sides of a triangle count.
  // Thread-safe, as all of the following.
  bool Intersect(const RayD& ray, double max_distance, MeshHit* hit) const;
  // Whether anything lies at a distance in (0, max_distance).
  bool Occluded(const RayD& ray, double max_distance) const;
  // Distance of p to the nearest point of the mesh.
  double Distance(const Vec3d& p) const;

 private:
  struct alignas(16) Node {
    float bound[6][4];  // low x, y, z, high x, y, z of four children
    // >= 0: a node; < 0: the block of triangles -1 - child; kEmpty: nothing.
    std::int32_t child[4];
  };
  // Four triangles, coordinate by coordinate; a missing one has no extent and no index. The mesh's
  // vertices are representable in single precision: half the memory, and exact.
  struct alignas(16) Block {
    float corner[3][3][4];  // of corner a, b, c: x, y, z of four triangles
    std::uint32_t index[4];
  };

  template <bool kAnyHit>
  bool Traverse(const RayD& ray, double max_distance, MeshHit* hit) const;

  friend class BvhBuilder;
  std::vector<Node> nodes_;
  std::vector<Block> blocks_;
};

}  // namespace sherd::synthetic
