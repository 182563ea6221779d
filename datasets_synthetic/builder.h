// Puts the excavation together: stones, finds and the surveyor's furniture, on the terrain.
#pragma once

#include <cstdint>
#include <vector>

#include "datasets_synthetic/part.h"
#include "datasets_synthetic/terrain.h"
#include "datasets_synthetic/triangle_mesh.h"

namespace sherd::synthetic {

class SceneBuilder {
 public:
  SceneBuilder(std::uint32_t seed, const Terrain& terrain, TriangleMesh* mesh,
               std::vector<Part>* parts)
      : seed_(seed), terrain_(terrain), mesh_(mesh), parts_(parts) {}

  // stones.cc
  void AddStoneWall();
  void AddLooseStones();
  // finds.cc
  void AddSherds();
  void AddJar();
  // furniture.cc
  void AddRangePole();
  void AddScaleBar();
  // The board's lower left corner is its frame's origin; x runs along the text, y up the board, z
  // out of its face.
  Frame3 AddBoard(double width_m, double height_m);

 private:
  // A closed, convex, slightly rough stone. `half` are its half extents along the frame's axes,
  // `detail` the number of cells along the edge of each of six sides.
  struct Stone {
    Frame3 frame;
    Vec3d half;
    Vec3f color;
    int detail;
    std::uint64_t seed;
  };
  void AddStone(const Stone& stone);
  // A box whose faces meet in sharp edges, as a part of its own; cells of about `cell_m`.
  void AddBox(const Part& part, double cell_m);
  std::size_t AddPart(const Part& part);
  // Removes the triangles from `first` on that lie wholly in the earth.
  void DropBuried(std::size_t first_triangle);
  // Lets what was added since `first_vertex` down or up until its lowest place is `depth` under the
  // floor; returns by how much it moved.
  double Settle(std::size_t first_vertex, double depth);

  std::uint32_t seed_;
  const Terrain& terrain_;
  TriangleMesh* mesh_;
  std::vector<Part>* parts_;
};

}  // namespace sherd::synthetic
