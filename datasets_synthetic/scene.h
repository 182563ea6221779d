// The whole excavation: surface, materials, and the light that falls on it.
#pragma once

#include <cstdint>
#include <vector>

#include "datasets_synthetic/board_text.h"
#include "datasets_synthetic/bvh.h"
#include "datasets_synthetic/materials.h"
#include "datasets_synthetic/part.h"
#include "datasets_synthetic/terrain.h"
#include "datasets_synthetic/triangle_mesh.h"
#include "metaball/control.h"

namespace sherd::synthetic {

// Where a ray meets the surface, and what is needed to shade it.
struct SceneHit {
  MeshHit mesh;
  Vec3d point{};
  Vec3d normal{};         // of the triangle, unit, against the ray
  Vec3d smooth_normal{};  // interpolated, for shading, on the same side
};

class TrenchScene {
 public:
  explicit TrenchScene(std::uint32_t seed);
  TrenchScene(const TrenchScene&) = delete;  // its members refer to each other
  TrenchScene& operator=(const TrenchScene&) = delete;

  const TriangleMesh& mesh() const { return mesh_; }
  const Bvh& bvh() const { return bvh_; }
  const BoardText& board() const { return board_; }
  // The place on the board's face at (x, y) metres from its lower left corner, world.
  Vec3d OnBoard(double x, double y) const { return board_frame_.ToWorld({x, y, 0}); }

  bool Intersect(const RayD& ray, SceneHit* hit) const;
  int ObjectOf(const SceneHit& hit) const;
  Surface SurfaceAt(const SceneHit& hit, double footprint_m) const;

  // Sky light and sun at every vertex of the mesh, with about `rays` rays each; before it
  // everything lies in full light. Throws Cancelled.
  void BakeLight(int rays, int threads, const Control& control);
  // Linear radiance towards any side (all surfaces are matt), of a square of `footprint_m`; 1 is
  // the brightest a photograph holds.
  Vec3f Radiance(const SceneHit& hit, double footprint_m) const;
  // What a ray sees that meets nothing.
  Vec3f Sky(const Vec3d& direction) const;

 private:
  const Part& PartOf(const SceneHit& hit) const { return parts_[mesh_.part[hit.mesh.triangle]]; }
  static TriangleMesh Build(std::uint32_t seed, const Terrain& terrain, std::vector<Part>* parts,
                            Frame3* board_frame);

  struct Light {
    float sky = 0, sun = 0;  // visible shares, [0, 1]
  };
  void SmoothLight();

  std::uint32_t seed_;
  Terrain terrain_;
  BoardText board_;
  std::vector<Part> parts_;
  Frame3 board_frame_;
  TriangleMesh mesh_;
  std::vector<Vec3f> vertex_normals_;
  Bvh bvh_;
  Materials materials_;
  std::vector<Light> light_;  // one a vertex
};

}  // namespace sherd::synthetic
