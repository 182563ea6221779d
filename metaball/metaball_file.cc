#include "metaball/metaball_file.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "metaball/atomic_file.h"
#include "metaball/error.h"

namespace sherd {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little endian");
static_assert(sizeof(Vec3f) == 12 && sizeof(Rgb8) == 3);

constexpr char kMagic[8] = {'S', 'H', 'E', 'R', 'D', 'M', 'B', '\n'};
constexpr std::uint32_t kVersion = 1;

enum Channel : std::uint32_t { kRadiusChannel = 2, kColorChannel = 16 };  // thesis, figure 3.11
constexpr std::uint32_t kKnownChannels = kRadiusChannel | kColorChannel;

// docs/metaball_file.md describes each field.
struct Header {
  char magic[8];
  std::uint32_t version;
  std::uint32_t channels;
  std::uint64_t count;
  double origin[3];
  double unit;
  double threshold;
  float uniform_radius;
  std::uint8_t uniform_color[3];
  std::uint8_t reserved;
};
static_assert(sizeof(Header) == 72);

std::uint64_t BodyBytes(const Header& header) {
  return header.count * (12 + (header.channels & kRadiusChannel ? 4 : 0) +
                         (header.channels & kColorChannel ? 3 : 0));
}

template <class T>
void ReadChannel(std::ifstream& in, const std::string& path, std::uint64_t count,
                 std::vector<T>* channel) {
  channel->resize(count);
  const auto offset = in.tellg();
  in.read(reinterpret_cast<char*>(channel->data()),
          static_cast<std::streamsize>(count * sizeof(T)));
  if (!in) {
    throw InputError(path, "byte " + std::to_string(static_cast<std::int64_t>(offset)),
                     "reading failed", "copy the file again from its source");
  }
}

}  // namespace

bool IsMetaballFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  char magic[8];
  return in.read(magic, 8) && std::memcmp(magic, kMagic, 8) == 0;
}

MetaballFile ReadMetaballFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path, "", "cannot be opened", "check the name and the permissions");
  Header header;
  if (!in.read(reinterpret_cast<char*>(&header), sizeof header)) {
    throw InputError(path, "byte 0", "is too short for a metaball file", "copy or export it again");
  }
  if (std::memcmp(header.magic, kMagic, 8) != 0) {
    throw InputError(path, "byte 0", "is no metaball file", "see docs/metaball_file.md");
  }
  if (header.version != kVersion) {
    throw InputError(path, "byte 8",
                     "has version " + std::to_string(header.version) + ", this program reads " +
                         std::to_string(kVersion),
                     "use a newer Sherd");
  }
  if (header.channels & ~kKnownChannels) {
    throw InputError(path, "byte 12", "has channels this program does not know",
                     "use a newer Sherd");
  }
  std::error_code code;
  const std::uint64_t size = std::filesystem::file_size(path, code);
  // Checked before anything is allocated; the count cannot make the product overflow.
  if (code || header.count > size / 12 || sizeof header + BodyBytes(header) != size) {
    throw InputError(path, "byte 16",
                     std::to_string(header.count) + " metaballs do not fit a file of " +
                         std::to_string(size) + " bytes",
                     "the file is damaged or cut off: copy or export it again");
  }
  if (!(header.threshold > 0) || !std::isfinite(header.threshold)) {
    throw InputError(path, "byte 56", "the threshold must be positive", "export it again");
  }
  MetaballFile file;
  file.threshold = header.threshold;
  Cloud& cloud = file.cloud;
  cloud.frame.origin = {header.origin[0], header.origin[1], header.origin[2]};
  cloud.frame.unit = header.unit;
  cloud.uniform_radius = header.uniform_radius;
  cloud.uniform_color = {header.uniform_color[0], header.uniform_color[1], header.uniform_color[2]};
  ReadChannel(in, path, header.count, &cloud.center);
  if (header.channels & kRadiusChannel) ReadChannel(in, path, header.count, &cloud.radius);
  if (header.channels & kColorChannel) ReadChannel(in, path, header.count, &cloud.color);
  cloud.Validate(path);
  return file;
}

void WriteMetaballFile(const std::string& path, const Cloud& cloud, double threshold) {
  Header header{};
  std::memcpy(header.magic, kMagic, 8);
  header.version = kVersion;
  header.channels =
      (cloud.radius.empty() ? 0u : kRadiusChannel) | (cloud.color.empty() ? 0u : kColorChannel);
  header.count = cloud.size();
  header.origin[0] = cloud.frame.origin.x;
  header.origin[1] = cloud.frame.origin.y;
  header.origin[2] = cloud.frame.origin.z;
  header.unit = cloud.frame.unit;
  header.threshold = threshold;
  header.uniform_radius = cloud.uniform_radius;
  header.uniform_color[0] = cloud.uniform_color.r;
  header.uniform_color[1] = cloud.uniform_color.g;
  header.uniform_color[2] = cloud.uniform_color.b;
  AtomicFile out(path);
  out.Write(&header, sizeof header);
  out.Write(cloud.center.data(), cloud.center.size() * sizeof(Vec3f));
  out.Write(cloud.radius.data(), cloud.radius.size() * sizeof(float));
  out.Write(cloud.color.data(), cloud.color.size() * sizeof(Rgb8));
  out.Commit();
}

}  // namespace sherd
