#include "reconstruction/depth_map.h"

#include <filesystem>

#include "reconstruction/binary_reader.h"

namespace sherd {
namespace {

constexpr int kMaxSide = 65536;

int ReadSide(BinaryReader* reader) {
  int value = 0;
  for (int digits = 0;; ++digits) {
    const char c = reader->Read<char>("the header of the map");
    if (c == '&' && digits > 0) return value;
    if (c < '0' || c > '9' || digits >= 5) {
      reader->FailAt(0, "does not begin with WIDTH&HEIGHT&CHANNELS&",
                     "this is no depth or normal map of COLMAP");
    }
    value = 10 * value + (c - '0');
  }
}

MapHeader ReadHeader(BinaryReader* reader) {
  MapHeader header;
  header.width = ReadSide(reader);
  header.height = ReadSide(reader);
  header.channels = ReadSide(reader);
  header.bytes = reader->position();
  if (header.width < 1 || header.height < 1 || header.width > kMaxSide ||
      header.height > kMaxSide || (header.channels != 1 && header.channels != 3)) {
    reader->FailAt(0, "declares an impossible map of " + std::to_string(header.width) + " x " +
                          std::to_string(header.height) + " pixels with " +
                          std::to_string(header.channels) + " channels");
  }
  const std::uint64_t bytes = header.pixels() * 4 * static_cast<std::uint64_t>(header.channels);
  if (reader->remaining() != bytes) {
    reader->Fail("the header declares " + std::to_string(bytes) + " bytes of " +
                     std::to_string(header.width) + " x " + std::to_string(header.height) +
                     " pixels, but " + std::to_string(reader->remaining()) + " follow",
                 "the file is cut off or damaged: copy it again");
  }
  return header;
}

}  // namespace

MapHeader ReadMapHeader(const std::string& path) {
  BinaryReader reader(path);
  return ReadHeader(&reader);
}

FloatMap ReadFloatMap(const std::string& path, int channels) {
  BinaryReader reader(path);
  const MapHeader header = ReadHeader(&reader);
  if (header.channels != channels) {
    reader.FailAt(0, "has " + std::to_string(header.channels) + " channels where " +
                         std::to_string(channels) + " are expected");
  }
  FloatMap map;
  map.width = header.width;
  map.height = header.height;
  map.channels = channels;
  map.values.resize(static_cast<std::size_t>(header.pixels()) * static_cast<std::size_t>(channels));
  reader.ReadBytes(map.values.data(), map.values.size() * 4, "the map");
  return map;
}

std::string FindMap(const std::string& folder, const std::string& name) {
  std::error_code error;
  for (const char* kind : {".geometric.bin", ".photometric.bin"}) {
    const std::string path = folder + "/" + name + kind;
    if (std::filesystem::is_regular_file(path, error)) return path;
  }
  return {};
}

}  // namespace sherd
