// The header of a PLY file. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sherd {

enum class PlyFormat { kAscii, kLittleEndian, kBigEndian };

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

std::uint64_t PlyTypeBytes(PlyType type);
inline bool PlyTypeIsFloat(PlyType type) {
  return type == PlyType::kFloat32 || type == PlyType::kFloat64;
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;
  bool list = false;
  PlyType count_type = PlyType::kUint8;  // of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  bool HasList() const;
  // Bytes of one record in a binary file; with lists, the least (all of them empty).
  std::uint64_t MinBytes() const;
};

struct PlyFileHeader {
  PlyFormat format = PlyFormat::kAscii;
  std::vector<PlyElement> elements;
  std::uint64_t bytes = 0;       // of the header: where the data begin
  std::uint64_t lines = 0;       // of the header
  std::uint64_t file_bytes = 0;  // of the whole file
  std::size_t vertex_element = 0;

  const PlyElement& vertices() const { return elements[vertex_element]; }
};

// Which property of the vertex element holds what; -1: none.
struct PlyLayout {
  int x = -1, y = -1, z = -1;
  int nx = -1, ny = -1, nz = -1;
  int red = -1, green = -1, blue = -1;
  int radius = -1;

  bool has_normals() const { return nx >= 0 && ny >= 0 && nz >= 0; }
  bool has_colors() const { return red >= 0 && green >= 0 && blue >= 0; }
};

// Reads and checks the header: the declared counts fit in the file, x, y and z are there. Throws
// InputError with the line.
PlyFileHeader ReadPlyFileHeader(const std::string& path);
PlyLayout LayoutOf(const PlyElement& vertices);

}  // namespace sherd
