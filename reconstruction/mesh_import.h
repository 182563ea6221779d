// Triangle meshes of other programs (.obj, .stl, .ply and whatever else assimp reads) and the
// metaballs made of them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/color.h"
#include "metaball/control.h"
#include "metaball/vec.h"

namespace sherd {

struct ImportedMesh {
  std::vector<Vec3d> position;           // as the file has it, through 32-bit numbers
  std::vector<Vec3f> normal;             // n or empty
  std::vector<Rgb8> color;               // n or empty, sRGB
  std::vector<std::array<float, 2>> uv;  // n or empty
  std::vector<std::array<std::uint32_t, 3>> triangle;
  std::string texture;  // the first one its materials name, as they name it; may be empty
};

// Whether the name's extension is that of a mesh this program is tested with: .obj, .stl, .off.
bool IsMeshFileName(const std::string& path);

// All parts of the file as one mesh; polygons are cut into triangles, loose points and lines are
// left out. Throws InputError for a file assimp cannot read or without triangles, Cancelled.
ImportedMesh ReadMesh(const std::string& path, const Control& control = {});

// Points of a mesh as metaballs: centres, colours, channels "normal" (unit) and "uv" where the mesh
// has them. No radii. Normals that the file does not have come from the triangles.
//
// At its vertices: those at the same place once, with what the first of them has.
CloudInput VerticesAsMetaballs(const ImportedMesh& mesh);
// `count` points spread over the triangles by area, evenly and without chance: the same mesh gives
// the same points. Colours are blended in linear light. Throws InputError with `path` where the
// triangles have no area.
CloudInput SamplesAsMetaballs(const ImportedMesh& mesh, std::uint64_t count,
                              const std::string& path);

}  // namespace sherd
