// The surface of a scene as triangles (thesis chapter 3 shows it by marching cubes, figure 3.5).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "metaball/color.h"
#include "metaball/control.h"
#include "metaball/scene.h"
#include "metaball/vec.h"

namespace sherd {

struct SurfaceMesh {
  std::vector<Vec3d> position;           // world
  std::vector<Vec3f> normal;             // unit, world axes, towards the outside
  std::vector<Rgb8> color;               // blended by the densities (thesis 3.1)
  std::vector<std::array<float, 2>> uv;  // blended channel "uv"; empty where the cloud has none
  // Corners counter-clockwise seen from outside. A corner's index is below position.size().
  std::vector<std::array<std::uint32_t, 3>> triangle;
};

struct MeshOptions {
  double cell_size = 0;  // world units; 0: DefaultCellSize
  int threads = 0;       // 0: all
};

// Half the median radius, scaled; 1 for an empty cloud.
double DefaultCellSize(const Scene& scene);

// The surface F = T of any density and threshold mode, by marching cubes on a grid of cubic cells.
//
// Every vertex lies on a grid edge, where the field crosses the threshold: to 1e-9 of the cell
// where the field is continuous. Vertices are shared, and every edge of the mesh belongs to exactly
// two triangles that run along it in opposite directions: the mesh is closed, because supports are
// finite. (Where the field on a cell's face has two opposite corners inside, they are taken as
// apart, on both sides alike.) What is thinner than a cell can be missed: choose the cell smaller
// then. Time and memory follow the metaballs' supports, counted in blocks of cells, not the box
// around them.
//
// The same scene and options give the same mesh, bit by bit, for any number of threads. Throws
// Error for a surface the renderers refuse, or a cell size that is not positive and finite or so
// small that the metaballs fill more blocks, or the mesh more indices, than can be counted;
// Cancelled.
SurfaceMesh ExtractMesh(const Scene& scene, const MeshOptions& options = {},
                        const Control& control = {});

// Binary little endian: x y z as doubles (surveys in UTM coordinates keep their digits), nx ny nz
// and, with uv, s t as floats, red green blue as bytes; a texture's name as a comment TextureFile.
// Throws OutputError; then no file of that name was made or changed.
void WritePlyMesh(const std::string& path, const SurfaceMesh& mesh,
                  const std::string& texture = "");
// Wavefront: v with colour (sRGB, 0 to 1), vt with uv, vn, and with uv and a texture a material
// file of the same name beside it. Numbers have as many digits as give the same number back. Throws
// OutputError.
void WriteObjMesh(const std::string& path, const SurfaceMesh& mesh,
                  const std::string& texture = "");

}  // namespace sherd
