#include "metaball/metaball_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
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
constexpr std::uint32_t kPlainVersion = 1, kFullVersion = 2;
constexpr const char* kDamaged = "the file is damaged or cut off: copy or export it again";

// The bits of the thesis, figure 3.11.
enum Present : std::uint32_t { kRadii = 2, kThresholds = 4, kColors = 16 };

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

// What follows in version 2, and then the density's text and the channels.
struct SurfaceHeader {
  double radius_scale;
  std::uint32_t mode;
  std::uint32_t density_bytes;
  std::uint32_t channels;
};
constexpr std::size_t kSurfaceHeaderBytes = 20;
static_assert(offsetof(SurfaceHeader, channels) + 4 == kSurfaceHeaderBytes);

// After a channel's name.
struct ChannelHeader {
  std::uint32_t type;
  std::uint32_t components;
  float lo, hi;
};
static_assert(sizeof(ChannelHeader) == 16);

std::string Byte(std::uint64_t offset) { return "byte " + std::to_string(offset); }

// The first value of a float channel that is not finite; its size where all are.
std::size_t FirstNotFinite(const Channel& channel) {
  if (channel.type() != ChannelType::kFloat32) return channel.size();
  for (std::size_t i = 0; i < channel.size(); ++i) {
    const ChannelValue value = channel.Get(i);
    for (const float v : value.v) {
      if (!std::isfinite(v)) return i;
    }
  }
  return channel.size();
}

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path), in_(path, std::ios::binary) {
    if (!in_) throw InputError(path, "", "cannot be opened", "check the name and the permissions");
    std::error_code code;
    size_ = std::filesystem::file_size(path, code);
    if (code) size_ = 0;
  }

  MetaballFile Read() {
    ReadHeader();
    MetaballFile file;
    file.threshold = header_.threshold;
    Cloud& cloud = file.cloud;
    cloud.frame.origin = {header_.origin[0], header_.origin[1], header_.origin[2]};
    cloud.frame.unit = header_.unit;
    cloud.uniform_radius = header_.uniform_radius;
    cloud.uniform_color = {header_.uniform_color[0], header_.uniform_color[1],
                           header_.uniform_color[2]};
    std::vector<NamedChannel> channels;
    if (header_.version == kFullVersion) channels = ReadSurface(&file);
    CheckSize(channels);
    ReadArray(header_.count, &cloud.center);
    if (header_.channels & kRadii) ReadArray(header_.count, &cloud.radius);
    if (header_.channels & kThresholds) ReadArray(header_.count, &cloud.threshold);
    if (header_.channels & kColors) ReadArray(header_.count, &cloud.color);
    for (const NamedChannel& c : channels) {
      const std::uint64_t begin = at_;
      Channel channel(c.name, static_cast<ChannelType>(c.header.type),
                      static_cast<int>(c.header.components), header_.count, c.header.lo,
                      c.header.hi);
      ReadBytes(channel.bytes().data(), channel.bytes().size());
      const std::size_t bad = FirstNotFinite(channel);
      if (bad < channel.size()) {
        Fail(begin + bad * channel.BytesPerMetaball(),
             "channel '" + c.name + "' is not finite at metaball " + std::to_string(bad),
             "export it again");
      }
      cloud.channels.push_back(std::move(channel));
    }
    cloud.Validate(path_);
    return file;
  }

 private:
  struct NamedChannel {
    std::string name;
    ChannelHeader header;
    std::size_t bytes;  // per metaball
  };

  [[noreturn]] void Fail(std::uint64_t offset, const std::string& what, const std::string& hint) {
    throw InputError(path_, Byte(offset), what, hint);
  }

  void ReadBytes(void* to, std::uint64_t bytes) {
    if (!in_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes))) {
      Fail(at_, "reading failed", kDamaged);
    }
    at_ += bytes;
  }
  template <class T>
  void ReadArray(std::uint64_t count, std::vector<T>* values) {
    values->resize(count);
    ReadBytes(values->data(), count * sizeof(T));
  }

  void ReadHeader() {
    if (!in_.read(reinterpret_cast<char*>(&header_), sizeof header_)) {
      Fail(0, "is too short for a metaball file", "copy or export it again");
    }
    at_ = sizeof header_;
    if (std::memcmp(header_.magic, kMagic, 8) != 0) {
      Fail(0, "is no metaball file", "see docs/metaball_file.md");
    }
    if (header_.version != kPlainVersion && header_.version != kFullVersion) {
      Fail(8,
           "has version " + std::to_string(header_.version) + ", this program reads " +
               std::to_string(kPlainVersion) + " and " + std::to_string(kFullVersion),
           "use a newer Sherd");
    }
    const std::uint32_t known =
        kRadii | kColors | (header_.version == kFullVersion ? kThresholds : 0u);
    if (header_.channels & ~known) {
      Fail(12, "has channels this program does not know", "use a newer Sherd");
    }
    if (!(header_.threshold > 0) || !std::isfinite(header_.threshold)) {
      Fail(56, "the threshold must be positive", "export it again");
    }
  }

  // Bytes a name or a table declares must be there before they are believed.
  void ExpectRoom(std::uint64_t declared_at, std::uint64_t bytes, const char* what) {
    if (size_ < at_ || bytes > size_ - at_) {
      Fail(declared_at, std::string(what) + " does not fit the file", kDamaged);
    }
  }

  std::vector<NamedChannel> ReadSurface(MetaballFile* file) {
    SurfaceHeader surface;
    const std::uint64_t begin = at_;
    ExpectRoom(begin, kSurfaceHeaderBytes, "the surface");
    ReadBytes(&surface, kSurfaceHeaderBytes);
    file->radius_scale = surface.radius_scale;
    if (!(surface.radius_scale > 0) || !std::isfinite(surface.radius_scale)) {
      Fail(begin, "the radius scale must be positive", "export it again");
    }
    if (surface.mode > static_cast<std::uint32_t>(ThresholdMode::kGated)) {
      Fail(begin + 8, "has threshold mode " + std::to_string(surface.mode), "use a newer Sherd");
    }
    file->mode = static_cast<ThresholdMode>(surface.mode);
    ExpectRoom(begin + 12, surface.density_bytes, "the density's name");
    std::string density(surface.density_bytes, '\0');
    const std::uint64_t density_at = at_;
    ReadBytes(density.data(), density.size());
    try {
      file->density = ParseDensity(density);
    } catch (const InputError& error) {
      Fail(density_at, error.message(), error.hint());
    }
    // A channel takes a length, a letter and its header at least.
    if (surface.channels > (size_ - at_) / (4 + 1 + sizeof(ChannelHeader))) {
      Fail(begin + 16, std::to_string(surface.channels) + " channels do not fit the file",
           kDamaged);
    }
    std::vector<NamedChannel> channels;
    for (std::uint32_t k = 0; k < surface.channels; ++k) channels.push_back(ReadChannelHeader());
    return channels;
  }

  NamedChannel ReadChannelHeader() {
    NamedChannel channel;
    const std::uint64_t begin = at_;
    std::uint32_t length = 0;
    ExpectRoom(begin, sizeof length, "a channel");
    ReadBytes(&length, sizeof length);
    ExpectRoom(begin, std::uint64_t{length} + sizeof(ChannelHeader), "a channel");
    channel.name.resize(length);
    ReadBytes(channel.name.data(), length);
    const std::uint64_t header_at = at_;
    ReadBytes(&channel.header, sizeof channel.header);
    if (channel.header.type > static_cast<std::uint32_t>(ChannelType::kOctahedral)) {
      Fail(header_at, "channel '" + channel.name + "' has a type this program does not know",
           "use a newer Sherd");
    }
    try {
      const int components = static_cast<int>(std::min(channel.header.components, 99u));
      channel.bytes = Channel(channel.name, static_cast<ChannelType>(channel.header.type),
                              components, 0, channel.header.lo, channel.header.hi)
                          .BytesPerMetaball();
    } catch (const InputError&) {
      throw;
    } catch (const Error& error) {
      Fail(begin, error.what(), "export it again");
    }
    return channel;
  }

  // Checked before anything is allocated; the count cannot make the product overflow, for the
  // channels of a file are fewer than its bytes / 21 and take at most 16 bytes a metaball each.
  void CheckSize(const std::vector<NamedChannel>& channels) {
    std::uint64_t each = 12 + (header_.channels & kRadii ? 4 : 0) +
                         (header_.channels & kThresholds ? 4 : 0) +
                         (header_.channels & kColors ? 3 : 0);
    for (const NamedChannel& channel : channels) each += channel.bytes;
    const std::uint64_t left = size_ < at_ ? 0 : size_ - at_;
    if (header_.count > left / each || header_.count * each != left) {
      Fail(16,
           std::to_string(header_.count) + " metaballs do not fit a file of " +
               std::to_string(size_) + " bytes",
           kDamaged);
    }
  }

  const std::string& path_;
  std::ifstream in_;
  std::uint64_t size_ = 0, at_ = 0;
  Header header_{};
};

bool IsPlain(const Cloud& cloud, const Surface& surface) {
  return cloud.threshold.empty() && cloud.channels.empty() && surface.radius_scale == 1.0 &&
         surface.mode == ThresholdMode::kUniform && TextOf(surface.density) == TextOf({});
}

void WriteSurface(const Cloud& cloud, const Surface& surface, AtomicFile* out) {
  const std::string density = TextOf(surface.density);
  const SurfaceHeader header{surface.radius_scale, static_cast<std::uint32_t>(surface.mode),
                             static_cast<std::uint32_t>(density.size()),
                             static_cast<std::uint32_t>(cloud.channels.size())};
  out->Write(&header, kSurfaceHeaderBytes);
  out->Write(density.data(), density.size());
  for (const Channel& channel : cloud.channels) {
    const auto length = static_cast<std::uint32_t>(channel.name().size());
    out->Write(&length, sizeof length);
    out->Write(channel.name().data(), length);
    const ChannelHeader channel_header{static_cast<std::uint32_t>(channel.type()),
                                       static_cast<std::uint32_t>(channel.components()),
                                       channel.lo(), channel.hi()};
    out->Write(&channel_header, sizeof channel_header);
  }
}

// Version 1 was never checked when written; what is new is.
void CheckForWriting(const std::string& path, const Cloud& cloud, const Surface& surface) {
  cloud.Validate(path);
  ResolveDensity(surface.density);
  if (!(surface.threshold > 0) || !std::isfinite(surface.threshold) ||
      !(surface.radius_scale > 0) || !std::isfinite(surface.radius_scale)) {
    throw InputError(path, "", "threshold and radius scale must be positive and finite");
  }
  for (const Channel& channel : cloud.channels) {
    const std::size_t bad = FirstNotFinite(channel);
    if (bad < channel.size()) {
      throw InputError(path, "metaball " + std::to_string(bad),
                       "channel '" + channel.name() + "' is not finite");
    }
  }
}

}  // namespace

Surface MetaballFile::SurfaceOf() const {
  Surface surface;
  surface.threshold = threshold;
  surface.radius_scale = radius_scale;
  surface.density = density;
  surface.mode = mode;
  return surface;
}

bool IsMetaballFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  char magic[8];
  return in.read(magic, 8) && std::memcmp(magic, kMagic, 8) == 0;
}

MetaballFile ReadMetaballFile(const std::string& path) { return Reader(path).Read(); }

void WriteMetaballFile(const std::string& path, const Cloud& cloud, const Surface& surface) {
  const bool plain = IsPlain(cloud, surface);
  if (!plain) CheckForWriting(path, cloud, surface);
  Header header{};
  std::memcpy(header.magic, kMagic, 8);
  header.version = plain ? kPlainVersion : kFullVersion;
  header.channels = (cloud.radius.empty() ? 0u : kRadii) |
                    (cloud.threshold.empty() ? 0u : kThresholds) |
                    (cloud.color.empty() ? 0u : kColors);
  header.count = cloud.size();
  header.origin[0] = cloud.frame.origin.x;
  header.origin[1] = cloud.frame.origin.y;
  header.origin[2] = cloud.frame.origin.z;
  header.unit = cloud.frame.unit;
  header.threshold = surface.threshold;
  header.uniform_radius = cloud.uniform_radius;
  header.uniform_color[0] = cloud.uniform_color.r;
  header.uniform_color[1] = cloud.uniform_color.g;
  header.uniform_color[2] = cloud.uniform_color.b;
  AtomicFile out(path);
  out.Write(&header, sizeof header);
  if (!plain) WriteSurface(cloud, surface, &out);
  out.Write(cloud.center.data(), cloud.center.size() * sizeof(Vec3f));
  out.Write(cloud.radius.data(), cloud.radius.size() * sizeof(float));
  out.Write(cloud.threshold.data(), cloud.threshold.size() * sizeof(float));
  out.Write(cloud.color.data(), cloud.color.size() * sizeof(Rgb8));
  for (const Channel& channel : cloud.channels) {
    out.Write(channel.bytes().data(), channel.bytes().size());
  }
  out.Commit();
}

void WriteMetaballFile(const std::string& path, const Cloud& cloud, double threshold) {
  Surface surface;
  surface.threshold = threshold;
  WriteMetaballFile(path, cloud, surface);
}

}  // namespace sherd
