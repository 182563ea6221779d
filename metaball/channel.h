// One further channel of the information vector V (thesis 2.1.1): a named value for each metaball,
// blended at a surface point by the same weights as everything else. Stored as narrow as it may be.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "metaball/hostdevice.h"

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

// A channel's values where they lie, on the host or on a device.
struct ChannelView {
  const std::byte* bytes = nullptr;
  ChannelType type = ChannelType::kFloat32;
  int components = 1;
  float lo = 0.0f, hi = 1.0f;

  // Of metaball i; components beyond `components` are 0.
  SHERD_HD ChannelValue Get(std::size_t i) const;

 private:
  template <class T>
  SHERD_HD static T Load(const std::byte* from, int k) {
    // Whole values lie at whole multiples of their size: one load, where bytes would be several.
    const void* const aligned = __builtin_assume_aligned(from + k * sizeof(T), alignof(T));
    T value;
    std::memcpy(&value, aligned, sizeof(T));
    return value;
  }
  SHERD_HD static ChannelValue DecodeOctahedral(const std::byte* from) {
    float x = static_cast<float>(Load<std::uint16_t>(from, 0) - 32767) / 32767.0f;
    float y = static_cast<float>(Load<std::uint16_t>(from, 1) - 32767) / 32767.0f;
    const float z = 1.0f - fabsf(x) - fabsf(y);
    if (z < 0.0f) {
      const float unfolded_x = copysignf(1.0f - fabsf(y), x);
      y = copysignf(1.0f - fabsf(x), y);
      x = unfolded_x;
    }
    const float length = sqrtf(x * x + y * y + z * z);
    return {{x / length, y / length, z / length, 0.0f}};
  }
};

SHERD_HD ChannelValue ChannelView::Get(std::size_t i) const {
  const int n = components;
  ChannelValue value;
  switch (type) {
    case ChannelType::kOctahedral:
      return DecodeOctahedral(bytes + i * 4);
    case ChannelType::kUnorm16:
      for (int k = 0; k < n; ++k) {
        value.v[k] = lo + (hi - lo) * (Load<std::uint16_t>(bytes + i * 2 * n, k) / 65535.0f);
      }
      break;
    case ChannelType::kUnorm8:
      for (int k = 0; k < n; ++k) {
        value.v[k] = lo + (hi - lo) * (Load<std::uint8_t>(bytes + i * n, k) / 255.0f);
      }
      break;
    case ChannelType::kFloat32:
      for (int k = 0; k < n; ++k) value.v[k] = Load<float>(bytes + i * 4 * n, k);
  }
  return value;
}

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

  ChannelView view() const { return {bytes_.data(), type_, components_, lo_, hi_}; }
  // Components beyond components() are 0. i < size().
  ChannelValue Get(std::size_t i) const { return view().Get(i); }
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
