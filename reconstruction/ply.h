// PLY files as point clouds: COLMAP's and everybody else's (ascii, both byte orders, any scalar
// types, extra and list properties, face elements).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metaball/color.h"
#include "metaball/control.h"
#include "metaball/vec.h"

namespace sherd {

struct PlyCloud {
  std::vector<Vec3d> position;
  std::vector<double> radius;  // n or empty
  std::vector<Rgb8>
      color;  // n or empty; integer properties are sRGB, float properties linear [0, 1]
  std::vector<Vec3f> normal;  // n or empty
  std::uint64_t faces = 0;
  bool float_positions = false;  // x, y, z are 32-bit: coordinates far from 0 lost digits before us
};

struct PlyHeader {
  std::uint64_t vertices = 0, faces = 0;
  bool has_normals = false, has_colors = false, has_radius = false;
};

// Header only. Throws InputError with the header's line.
PlyHeader ReadPlyHeader(const std::string& path);
// Declared counts are checked against the file's size before anything is allocated. Throws
// InputError with the line or byte, Cancelled.
PlyCloud ReadPly(const std::string& path, const Control& control = {});

}  // namespace sherd
