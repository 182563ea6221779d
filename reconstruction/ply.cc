#include "reconstruction/ply.h"

#include "metaball/error.h"
#include "reconstruction/memory.h"
#include "reconstruction/ply_header.h"
#include "reconstruction/ply_stream.h"

namespace sherd {

PlyCloud ReadPly(const std::string& path, const Control& control) {
  PlyStream stream(path);
  const PlyLayout& layout = stream.layout();
  const std::uint64_t n = stream.count();
  CheckMemory(path, n * (24 + (layout.has_colors() ? 3 : 0) + (layout.has_normals() ? 12 : 0) +
                         (layout.radius >= 0 ? 8 : 0)));
  PlyCloud cloud;
  for (const PlyElement& element : stream.header().elements) {
    if (element.name == "face") cloud.faces = element.count;
  }
  const auto& properties = stream.header().vertices().properties;
  cloud.float_positions = properties[layout.x].type == PlyType::kFloat32;
  cloud.position.reserve(n);
  if (layout.has_colors()) cloud.color.reserve(n);
  if (layout.has_normals()) cloud.normal.reserve(n);
  if (layout.radius >= 0) cloud.radius.reserve(n);
  PlyVertex vertex;
  for (std::uint64_t i = 0; i < n; ++i) {
    if (i % (1 << 16) == 0) {
      control.ThrowIfStopped();
      control.Report("reading points", static_cast<double>(i) / static_cast<double>(n));
    }
    stream.Next(&vertex);
    cloud.position.push_back(vertex.position);
    if (layout.has_colors()) cloud.color.push_back(stream.ColorOf(vertex));
    if (layout.has_normals()) cloud.normal.push_back(vertex.normal);
    if (layout.radius >= 0) cloud.radius.push_back(vertex.radius);
  }
  stream.ExpectEnd();
  return cloud;
}

}  // namespace sherd
