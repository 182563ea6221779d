// Triangle meshes of other programs, read by assimp. What becomes of them: mesh_points.h.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "metaball/color.h"
#include "metaball/control.h"
#include "metaball/vec.h"

namespace sherd {

enum class MeshWrap { kRepeat, kClamp, kMirror };  // of a texture beyond [0, 1]

struct MeshTexture {
  std::string name;                  // as the mesh names it; for people
  std::string path;                  // the file found for it; empty: none, or it is embedded
  std::vector<std::uint8_t> pixels;  // embedded: the bytes of the picture's file
  MeshWrap wrap_u = MeshWrap::kRepeat, wrap_v = MeshWrap::kRepeat;
};

// n = position.size(); every other array of the vertices has n entries or none.
struct ImportedMesh {
  std::string path;
  std::vector<Vec3d> position;  // as the file has it, through 32-bit numbers
  std::vector<Vec3f> normal;    // unit
  // Linear light: the vertices' own colours, else those of their materials. None where the file
  // knows neither colours nor textures.
  std::vector<Vec3f> color;
  std::vector<std::array<float, 2>> uv;  // u to the right, v up, in every format
  bool uv_everywhere = false;            // no part of the mesh is without
  std::vector<std::uint32_t> texture;    // of each vertex, into `textures`, or kNoTexture
  static constexpr std::uint32_t kNoTexture = UINT32_MAX;
  std::vector<std::array<std::uint32_t, 3>> triangle;
  std::vector<MeshTexture> textures;
  // Whether textures are multiplied with `color` (glTF) or take its place.
  bool textures_multiply = false;
  std::vector<std::string> warnings;  // one line each: files that are missing

  // The image that all of `uv` belongs to, as the mesh names it; empty where there is none, where
  // there are several, and where it is no file.
  std::string TextureName() const;
};

// Of the meshes this program is tested with.
inline constexpr std::array kMeshExtensions = {".obj", ".stl",  ".off", ".3ds",
                                               ".glb", ".gltf", ".dae", ".fbx"};
std::string MeshExtensionList();  // ".obj, .stl, ..."
bool IsMeshFileName(const std::string& path);

// Whether the format says that +y is up (glTF); the others leave that open.
bool IsMeshWithYUp(const std::string& path);

// All parts of the file as one mesh, in the file's own coordinates; polygons are cut into
// triangles, loose points and lines are left out. Textures are looked for where the mesh names
// them, relative to it, and beside it. Throws InputError for a file assimp cannot read or without
// triangles, Cancelled; ResourceError where reading would need more than `memory_limit_bytes` (0:
// 80 % of what is free), judged from the sizes of all files that belong to the mesh: 12 bytes a
// byte, 16 for .ply, 20 for .fbx, 42 for .stl (measured at a million triangles), and 72 bytes a
// vertex of what the file places, copies included.
ImportedMesh ReadMesh(const std::string& path, const Control& control = {},
                      std::uint64_t memory_limit_bytes = 0);

}  // namespace sherd
