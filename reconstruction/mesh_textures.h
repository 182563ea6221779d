// The textures of a mesh. Internal to reconstruction/.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "metaball/vec.h"
#include "reconstruction/mesh_import.h"

namespace sherd {

// The file that a mesh in `folder` means by `name`: at that place relative to the mesh (also with
// %20 for a blank, and \ for /), else of that name beside the mesh, the case left aside. Empty
// where there is none.
std::string FindTexture(const std::string& folder, const std::string& name);

// Colours points that have a texture: `texture` (into mesh.textures, or kNoTexture) and `uv`, one
// each, give what `color` (linear light) becomes, as mesh.textures_multiply says. Bilinear, at the
// texture's full resolution. One line in `warnings` for a texture that is missing or cannot be
// read, whose points stay as they are. One texture is held at a time: ResourceError where that
// needs more than `memory_limit_bytes` (0: 80 % of what is free). Throws Cancelled.
void ApplyTextures(const ImportedMesh& mesh, const std::vector<std::uint32_t>& texture,
                   const std::vector<std::array<float, 2>>& uv, std::uint64_t memory_limit_bytes,
                   const Control& control, std::vector<Vec3f>* color,
                   std::vector<std::string>* warnings);

}  // namespace sherd
