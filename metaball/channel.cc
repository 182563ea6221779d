#include "metaball/channel.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

template <class T>
void Store(std::byte* to, int k, T value) {
  std::memcpy(to + k * sizeof(T), &value, sizeof(T));
}

template <class T>
T Quantized(float v, float lo, float hi, T steps) {
  const float u = (v - lo) / (hi - lo);
  if (!(u > 0.0f)) return 0;
  return static_cast<T>(std::lround(std::min(u, 1.0f) * static_cast<float>(steps)));
}

// The octahedral map: the unit sphere onto the octahedron |x| + |y| + |z| = 1, its lower half
// folded out into the square.
void EncodeOctahedral(const float* v, std::byte* to) {
  const float sum = std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]);
  float x = 0.0f, y = 0.0f;
  if (sum > 0.0f && std::isfinite(sum)) {
    x = v[0] / sum;
    y = v[1] / sum;
    if (v[2] < 0.0f) {
      const float folded_x = std::copysign(1.0f - std::abs(y), x);
      y = std::copysign(1.0f - std::abs(x), y);
      x = folded_x;
    }
  }
  // 32767 is the middle of 0..65534, so that the axes are exact.
  Store<std::uint16_t>(to, 0, static_cast<std::uint16_t>(std::lround(x * 32767.0f) + 32767));
  Store<std::uint16_t>(to, 1, static_cast<std::uint16_t>(std::lround(y * 32767.0f) + 32767));
}

}  // namespace

Channel::Channel(std::string name, ChannelType type, int components, std::size_t n, float lo,
                 float hi)
    : name_(std::move(name)), type_(type), components_(components), lo_(lo), hi_(hi), size_(n) {
  if (name_.empty()) throw Error("a channel needs a name");
  if (components < 1 || components > 4 || (type == ChannelType::kOctahedral && components != 3)) {
    throw Error("channel '" + name_ + "' cannot have " + std::to_string(components) +
                " components");
  }
  const bool ranged = type == ChannelType::kUnorm16 || type == ChannelType::kUnorm8;
  if (ranged && (!(lo < hi) || !std::isfinite(hi - lo))) {
    throw Error("channel '" + name_ + "' needs a finite range with lo < hi");
  }
  bytes_.resize(n * BytesPerMetaball());
  if (type == ChannelType::kOctahedral) {
    for (std::size_t i = 0; i < n; ++i) Set(i, {});
  }
}

std::size_t Channel::BytesPerMetaball() const {
  switch (type_) {
    case ChannelType::kFloat32:
      return 4 * static_cast<std::size_t>(components_);
    case ChannelType::kUnorm16:
      return 2 * static_cast<std::size_t>(components_);
    case ChannelType::kUnorm8:
      return static_cast<std::size_t>(components_);
    case ChannelType::kOctahedral:
      return 4;
  }
  return 0;
}

void Channel::Set(std::size_t i, const ChannelValue& value) {
  std::byte* to = bytes_.data() + i * BytesPerMetaball();
  if (type_ == ChannelType::kOctahedral) {
    EncodeOctahedral(value.v, to);
    return;
  }
  for (int k = 0; k < components_; ++k) {
    switch (type_) {
      case ChannelType::kUnorm16:
        Store(to, k, Quantized<std::uint16_t>(value.v[k], lo_, hi_, 65535));
        break;
      case ChannelType::kUnorm8:
        Store(to, k, Quantized<std::uint8_t>(value.v[k], lo_, hi_, 255));
        break;
      default:
        Store(to, k, value.v[k]);
    }
  }
}

Channel Channel::Reordered(const std::vector<std::uint32_t>& order) const {
  Channel result;
  result.name_ = name_;
  result.type_ = type_;
  result.components_ = components_;
  result.lo_ = lo_;
  result.hi_ = hi_;
  result.size_ = order.size();
  const std::size_t stride = BytesPerMetaball();
  result.bytes_.resize(order.size() * stride);
  for (std::size_t k = 0; k < order.size(); ++k) {
    std::memcpy(result.bytes_.data() + k * stride, bytes_.data() + order[k] * stride, stride);
  }
  return result;
}

}  // namespace sherd
