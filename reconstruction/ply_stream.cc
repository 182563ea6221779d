#include "reconstruction/ply_stream.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "metaball/error.h"
#include "reconstruction/binary_reader.h"
#include "reconstruction/text_reader.h"

namespace sherd {

// Gives the scalar values of one record after another.
struct PlyStream::Source {
  virtual ~Source() = default;
  // Reads a record of `element` into values[property] (lists are passed over and leave theirs).
  virtual void ReadRecord(const PlyElement& element, double* values) = 0;
  virtual void ExpectEnd(std::uint64_t record_bytes) = 0;
};

namespace {

template <class T>
T Swapped(T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  std::reverse(bytes, bytes + sizeof(T));
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

template <class T>
double Get(const char* from, bool swap) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return static_cast<double>(swap ? Swapped(value) : value);
}

double GetScalar(const char* from, PlyType type, bool swap) {
  switch (type) {
    case PlyType::kInt8:
      return Get<std::int8_t>(from, swap);
    case PlyType::kUint8:
      return Get<std::uint8_t>(from, swap);
    case PlyType::kInt16:
      return Get<std::int16_t>(from, swap);
    case PlyType::kUint16:
      return Get<std::uint16_t>(from, swap);
    case PlyType::kInt32:
      return Get<std::int32_t>(from, swap);
    case PlyType::kUint32:
      return Get<std::uint32_t>(from, swap);
    case PlyType::kFloat32:
      return Get<float>(from, swap);
    case PlyType::kFloat64:
      return Get<double>(from, swap);
  }
  return 0;
}

}  // namespace

struct PlyStream::BinarySource : PlyStream::Source {
  BinarySource(const std::string& path, const PlyFileHeader& header)
      : reader(path), swap(header.format == PlyFormat::kBigEndian) {
    reader.Skip(header.bytes, "the header");
  }

  void ReadRecord(const PlyElement& element, double* values) override {
    const char* const what = "a record";
    if (!element.HasList()) {
      record.resize(static_cast<std::size_t>(element.MinBytes()));
      reader.ReadBytes(record.data(), record.size(), what);
      const char* from = record.data();
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        values[i] = GetScalar(from, element.properties[i].type, swap);
        from += PlyTypeBytes(element.properties[i].type);
      }
      return;
    }
    char scalar[8];
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (!property.list) {
        reader.ReadBytes(scalar, PlyTypeBytes(property.type), what);
        values[i] = GetScalar(scalar, property.type, swap);
        continue;
      }
      reader.ReadBytes(scalar, PlyTypeBytes(property.count_type), what);
      const double length = GetScalar(scalar, property.count_type, swap);
      if (length < 0) reader.Fail("a list has a negative length");
      const auto entries = static_cast<std::uint64_t>(length);
      reader.CheckCount(entries, PlyTypeBytes(property.type), "entries of a list");
      reader.Skip(entries * PlyTypeBytes(property.type), "a list");
    }
  }

  void ExpectEnd(std::uint64_t record_bytes) override {
    if (record_bytes > 0 && reader.remaining() >= record_bytes) {
      reader.Fail(std::to_string(reader.remaining()) + " bytes follow the last declared vertex",
                  "the count in the header is wrong or the file is damaged");
    }
  }

  BinaryReader reader;
  bool swap;
  std::vector<char> record;
};

struct PlyStream::AsciiSource : PlyStream::Source {
  AsciiSource(const std::string& path, const PlyFileHeader& header) : reader(path) {
    std::string_view line;
    for (std::uint64_t i = 0; i < header.lines; ++i) reader.ReadLine(&line);
  }

  void ReadRecord(const PlyElement& element, double* values) override {
    std::string_view line;
    do {
      if (!reader.ReadLine(&line)) {
        reader.Fail("the file ends before the last declared '" + element.name + "'",
                    "the file is cut off or damaged: copy it again");
      }
    } while (Trimmed(line).empty());
    TokenReader tokens(reader, line);
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (!property.list) {
        values[i] = tokens.Number<double>(property.name.c_str());
        continue;
      }
      const auto entries = tokens.Number<std::uint64_t>("a list's length");
      for (std::uint64_t j = 0; j < entries; ++j) tokens.Token("an entry of a list");
    }
  }

  void ExpectEnd(std::uint64_t) override {
    std::string_view line;
    while (reader.ReadLine(&line)) {
      if (!Trimmed(line).empty()) {
        reader.Fail("more vertices follow the last declared one",
                    "the count in the header is wrong or the file is damaged");
      }
    }
  }

  TextReader reader;
};

PlyStream::PlyStream(const std::string& path)
    : header_(ReadPlyFileHeader(path)), layout_(LayoutOf(header_.vertices())) {
  if (header_.format == PlyFormat::kAscii) {
    source_ = std::make_unique<AsciiSource>(path, header_);
  } else {
    source_ = std::make_unique<BinarySource>(path, header_);
  }
  // Elements before the vertices are read past.
  for (std::size_t i = 0; i < header_.vertex_element; ++i) {
    const PlyElement& element = header_.elements[i];
    if (element.properties.empty()) continue;
    std::vector<double> values(element.properties.size());
    for (std::uint64_t j = 0; j < element.count; ++j) {
      source_->ReadRecord(element, values.data());
    }
  }
}

PlyStream::~PlyStream() = default;

void PlyStream::Next(PlyVertex* vertex) {
  double few[32];
  const PlyElement& element = header_.vertices();
  std::vector<double> many;
  double* values = few;
  if (element.properties.size() > std::size(few)) {
    many.resize(element.properties.size());
    values = many.data();
  }
  source_->ReadRecord(element, values);
  vertex->position = {values[layout_.x], values[layout_.y], values[layout_.z]};
  if (layout_.has_normals()) {
    vertex->normal =
        Vec3d{values[layout_.nx], values[layout_.ny], values[layout_.nz]}.cast<float>();
  }
  if (layout_.has_colors()) {
    vertex->color = {values[layout_.red], values[layout_.green], values[layout_.blue]};
  }
  if (layout_.radius >= 0) vertex->radius = values[layout_.radius];
}

void PlyStream::ExpectEnd() {
  if (header_.vertex_element + 1 == header_.elements.size()) {
    source_->ExpectEnd(header_.vertices().MinBytes());
  }
}

Rgb8 PlyStream::ColorOf(const PlyVertex& vertex) const {
  const PlyType type = header_.vertices().properties[layout_.red].type;
  const Vec3d& c = vertex.color;
  if (PlyTypeIsFloat(type)) return Rgb8FromLinear(c.cast<float>());
  const double scale = type == PlyType::kUint16 ? 255.0 / 65535.0 : 1.0;
  const auto byte = [&](double v) {
    return static_cast<std::uint8_t>(std::clamp(v * scale + 0.5, 0.0, 255.0));
  };
  return {byte(c.x), byte(c.y), byte(c.z)};
}

}  // namespace sherd
