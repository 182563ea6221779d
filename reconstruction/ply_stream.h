// The vertices of a PLY file, one after another, in bounded memory. Internal to reconstruction/.
#pragma once

#include <memory>
#include <string>

#include "metaball/color.h"
#include "metaball/vec.h"
#include "reconstruction/ply_header.h"

namespace sherd {

struct PlyVertex {
  Vec3d position{};
  Vec3f normal{};
  Vec3d color{};  // as the file has it; see PlyStream::ColorOf
  double radius = 0;
};

class PlyStream {
 public:
  // Throws InputError as ReadPlyFileHeader does.
  explicit PlyStream(const std::string& path);
  ~PlyStream();

  const PlyFileHeader& header() const { return header_; }
  const PlyLayout& layout() const { return layout_; }
  std::uint64_t count() const { return header_.vertices().count; }

  // Reads the next vertex; to be called count() times. Throws InputError with the byte or line.
  void Next(PlyVertex* vertex);
  // After the last vertex of a binary file without further elements: throws InputError when a whole
  // record or more is left over (the count in the header is too small).
  void ExpectEnd();

  // Integer properties are sRGB over their type's range (bytes; 0..65535 for 16 bits), floats are
  // linear in [0, 1].
  Rgb8 ColorOf(const PlyVertex& vertex) const;

 private:
  struct Source;
  struct BinarySource;
  struct AsciiSource;
  PlyFileHeader header_;
  PlyLayout layout_;
  std::unique_ptr<Source> source_;
};

}  // namespace sherd
