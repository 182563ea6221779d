#include "reconstruction/ply_header.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string_view>

#include "metaball/error.h"
#include "reconstruction/ply.h"
#include "reconstruction/text_reader.h"

namespace sherd {
namespace {

constexpr std::uint64_t kMaxHeaderBytes = 1 << 20;
constexpr std::size_t kMaxProperties = 4096;

std::optional<PlyType> TypeFromName(std::string_view name) {
  struct Entry {
    std::string_view name;
    PlyType type;
  };
  static constexpr Entry kTypes[] = {
      {"char", PlyType::kInt8},      {"int8", PlyType::kInt8},       {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},    {"short", PlyType::kInt16},     {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16},  {"uint16", PlyType::kUint16},   {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},    {"uint", PlyType::kUint32},     {"uint32", PlyType::kUint32},
      {"float", PlyType::kFloat32},  {"float32", PlyType::kFloat32}, {"double", PlyType::kFloat64},
      {"float64", PlyType::kFloat64}};
  for (const Entry& entry : kTypes) {
    if (entry.name == name) return entry.type;
  }
  return std::nullopt;
}

// The first part of a word from the file, for a message.
std::string Quoted(std::string_view word) {
  std::string text("'");
  text.append(word.substr(0, 40));
  text.push_back('\'');
  return text;
}

PlyType ReadType(const TextReader& reader, TokenReader* tokens) {
  const std::string_view name = tokens->Token("a property's type");
  const std::optional<PlyType> type = TypeFromName(name);
  if (!type) {
    reader.Fail(Quoted(name) + " is no type of a PLY property");
  }
  return *type;
}

int Find(const PlyElement& element, std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      if (element.properties[i].name == name && !element.properties[i].list) {
        return static_cast<int>(i);
      }
    }
  }
  return -1;
}

// Every declared record takes at least so many bytes: a count that cannot be true is found here,
// before anything is allocated.
void CheckCounts(const std::string& path, const PlyFileHeader& header) {
  std::uint64_t remaining = header.file_bytes - header.bytes;
  for (const PlyElement& element : header.elements) {
    std::uint64_t record = element.MinBytes();
    if (header.format == PlyFormat::kAscii) record = 2 * element.properties.size();
    // The very last line needs no end.
    const std::uint64_t available = remaining + (header.format == PlyFormat::kAscii ? 1 : 0);
    if (record > 0 && element.count > available / record) {
      throw InputError(path, "byte " + std::to_string(header.bytes),
                       "the header declares " + std::to_string(element.count) + " of '" +
                           element.name + "' (at least " + std::to_string(record) +
                           " bytes each), but only " + std::to_string(remaining) + " bytes follow",
                       "the file is cut off or damaged: copy it again");
    }
    if (record == 0 && element.count > 0 && element.properties.empty()) continue;
    remaining -= std::min(remaining, element.count * record);
  }
}

}  // namespace

std::uint64_t PlyTypeBytes(PlyType type) {
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kInt32:
    case PlyType::kUint32:
    case PlyType::kFloat32:
      return 4;
    case PlyType::kFloat64:
      return 8;
  }
  return 0;
}

bool PlyElement::HasList() const {
  return std::any_of(properties.begin(), properties.end(),
                     [](const PlyProperty& p) { return p.list; });
}

std::uint64_t PlyElement::MinBytes() const {
  std::uint64_t bytes = 0;
  for (const PlyProperty& p : properties) bytes += PlyTypeBytes(p.list ? p.count_type : p.type);
  return bytes;
}

PlyFileHeader ReadPlyFileHeader(const std::string& path) {
  TextReader reader(path);
  PlyFileHeader header;
  header.file_bytes = reader.size();
  std::string_view line;
  if (!reader.ReadLine(&line) || Trimmed(line) != "ply") {
    throw InputError(path, "line 1", "does not begin with 'ply'", "this is no PLY file");
  }
  bool has_format = false, has_end = false;
  while (!has_end && reader.ReadLine(&line)) {
    if (reader.position() > kMaxHeaderBytes) reader.Fail("the header is longer than 1 MB");
    TokenReader tokens(reader, line);
    if (tokens.AtEnd()) continue;
    const std::string_view keyword = tokens.Token("a keyword");
    if (keyword == "comment" || keyword == "obj_info") {
      continue;
    } else if (keyword == "format") {
      const std::string_view name = tokens.Token("the format");
      if (name == "ascii") {
        header.format = PlyFormat::kAscii;
      } else if (name == "binary_little_endian") {
        header.format = PlyFormat::kLittleEndian;
      } else if (name == "binary_big_endian") {
        header.format = PlyFormat::kBigEndian;
      } else {
        reader.Fail(Quoted(name) + " is no format of PLY files");
      }
      has_format = true;
    } else if (keyword == "element") {
      PlyElement element;
      element.name = std::string(tokens.Token("the element's name"));
      element.count = tokens.Number<std::uint64_t>("the number of records");
      header.elements.push_back(std::move(element));
      if (header.elements.size() > kMaxProperties) reader.Fail("the header has too many elements");
    } else if (keyword == "property") {
      if (header.elements.empty()) reader.Fail("a property stands before the first element");
      PlyProperty property;
      std::string_view rest = tokens.Rest();
      property.list = rest.starts_with("list ") || rest.starts_with("list\t");
      if (property.list) rest.remove_prefix(5);
      TokenReader parts(reader, rest);
      if (property.list) {
        property.count_type = ReadType(reader, &parts);
        if (PlyTypeIsFloat(property.count_type)) reader.Fail("a list's length must be an integer");
      }
      property.type = ReadType(reader, &parts);
      property.name = std::string(parts.Token("the property's name"));
      header.elements.back().properties.push_back(std::move(property));
      if (header.elements.back().properties.size() > kMaxProperties) {
        reader.Fail("the element has too many properties");
      }
    } else if (keyword == "end_header") {
      has_end = true;
    } else {
      reader.Fail(Quoted(keyword) + " is no keyword of a PLY header");
    }
  }
  if (!has_end) reader.Fail("the header has no end_header", "the file is cut off or damaged");
  if (!has_format) reader.Fail("the header names no format");
  header.bytes = reader.position();
  header.lines = reader.line_number();
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const PlyElement& e) { return e.name == "vertex"; });
  if (vertex == header.elements.end()) {
    reader.Fail("the file has no element 'vertex'", "only point clouds and meshes can be read");
  }
  header.vertex_element = static_cast<std::size_t>(vertex - header.elements.begin());
  const PlyLayout layout = LayoutOf(*vertex);
  if (layout.x < 0 || layout.y < 0 || layout.z < 0) {
    reader.Fail("the vertices have no properties x, y and z");
  }
  CheckCounts(path, header);
  return header;
}

PlyLayout LayoutOf(const PlyElement& vertices) {
  PlyLayout layout;
  layout.x = Find(vertices, {"x", "X"});
  layout.y = Find(vertices, {"y", "Y"});
  layout.z = Find(vertices, {"z", "Z"});
  layout.nx = Find(vertices, {"nx", "normal_x"});
  layout.ny = Find(vertices, {"ny", "normal_y"});
  layout.nz = Find(vertices, {"nz", "normal_z"});
  layout.red = Find(vertices, {"red", "r", "diffuse_red"});
  layout.green = Find(vertices, {"green", "g", "diffuse_green"});
  layout.blue = Find(vertices, {"blue", "b", "diffuse_blue"});
  layout.radius = Find(vertices, {"radius"});
  return layout;
}

PlyHeader ReadPlyHeader(const std::string& path) {
  const PlyFileHeader file = ReadPlyFileHeader(path);
  const PlyLayout layout = LayoutOf(file.vertices());
  PlyHeader header;
  header.vertices = file.vertices().count;
  for (const PlyElement& element : file.elements) {
    if (element.name == "face") header.faces = element.count;
  }
  header.has_normals = layout.has_normals();
  header.has_colors = layout.has_colors();
  header.has_radius = layout.radius >= 0;
  return header;
}

}  // namespace sherd
