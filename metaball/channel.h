// One further channel of the information vector V (thesis 2.1.1): a named value for each metaball,
// blended at a surface point by the same weights as everything else. Stored as narrow as it may be.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace sherd {

enum class ChannelType : std::uint8_t {
  kFloat32,     // 4 bytes a component
  kUnorm16,     // 2 bytes a component, lo..hi in 65535 steps
  kUnorm8,      // 1 byte a component, lo..hi in 255 steps
  kOctahedral,  // 4 bytes for a unit vector of 3 components (Cigolle et al. 2014), 2 x 16 bits
};

struct ChannelValue {
  float v[4] = {0.0f, 0.0f, 0.0f, 0.0f};
};

class Channel {
 public:
  Channel() = default;
  // n metaballs, all zero. components: 1..4, and 3 for kOctahedral. lo < hi, finite, for the unorm
  // types; not used by the others. Throws Error.
  Channel(std::string name, ChannelType type, int components, std::size_t n, float lo = 0.0f,
          float hi = 1.0f);

  const std::string& name() const { return name_; }
  ChannelType type() const { return type_; }
  int components() const { return components_; }
  float lo() const { return lo_; }
  float hi() const { return hi_; }
  std::size_t size() const { return size_; }
  std::size_t BytesPerMetaball() const;
  std::size_t MemoryBytes() const { return bytes_.capacity(); }
  const std::vector<std::byte>& bytes() const { return bytes_; }
  std::vector<std::byte>& bytes() { return bytes_; }

  // Components beyond components() are 0. i < size().
  ChannelValue Get(std::size_t i) const;
  // Unorm values are clamped to lo..hi; NaN becomes lo. Octahedral: any vector, made a unit vector;
  // one without direction becomes (0, 0, 1).
  void Set(std::size_t i, const ChannelValue& value);
  // The same channel with metaball k taken from order[k].
  Channel Reordered(const std::vector<std::uint32_t>& order) const;

 private:
  std::string name_;
  ChannelType type_ = ChannelType::kFloat32;
  int components_ = 1;
  float lo_ = 0.0f, hi_ = 1.0f;
  std::size_t size_ = 0;
  std::vector<std::byte> bytes_;
};

}  // namespace sherd
