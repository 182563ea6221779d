// Points of a mesh: its vertices, or samples of its surface.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/color.h"
#include "metaball/control.h"
#include "metaball/vec.h"
#include "reconstruction/mesh_import.h"

namespace sherd {

// n = position.size(); every other array has n entries or none.
struct MeshPoints {
  std::vector<Vec3d> position;
  std::vector<Vec3f> normal;  // unit; always there: from the triangles where the file has none
  std::vector<Rgb8> color;    // where the mesh has colours or textures
  std::vector<std::array<float, 2>> uv;  // where all of the mesh has them
  std::vector<std::string> warnings;     // one line each: the mesh's own, and its textures
};

// How many points are taken of a mesh's surface where nothing else was asked for: twice what the
// largest of the usual levels holds.
inline constexpr std::uint64_t kMeshSamples = 1'000'000;

// Both look the textures up at their full resolution, in linear light, one texture in memory at a
// time (4 bytes a pixel), and throw ResourceError where that or the points (100 bytes each) exceed
// `memory_limit_bytes` (0: 80 % of what is free), Cancelled.
//
// The vertices; those at the same place once, with what the first of them has.
MeshPoints PointsAtVertices(const ImportedMesh& mesh, const Control& control = {},
                            std::uint64_t memory_limit_bytes = 0);
// `count` points spread over the triangles by area, evenly and without chance: the same mesh gives
// the same points. Throws InputError where the triangles have no area.
MeshPoints PointsOnTriangles(const ImportedMesh& mesh, std::uint64_t count,
                             const Control& control = {}, std::uint64_t memory_limit_bytes = 0);

// As metaballs without radii: centres, colours, channels "normal" and "uv" where there are any.
CloudInput ToMetaballs(MeshPoints points);

}  // namespace sherd
