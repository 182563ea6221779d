#include "reconstruction/level_digest.h"

#include <array>
#include <cstddef>
#include <cstring>

namespace sherd {

std::uint64_t DigestOf(const Level& level) {
  std::uint64_t hash = 0xcbf29ce484222325ull;
  const auto add = [&](const void* data, std::size_t bytes) {
    const auto* p = static_cast<const unsigned char*>(data);
    for (; bytes >= 8; bytes -= 8, p += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, p, 8);
      hash = (hash ^ word) * 0x100000001b3ull;
      hash ^= hash >> 29;
    }
    for (; bytes > 0; --bytes, ++p) hash = (hash ^ *p) * 0x100000001b3ull;
  };
  const auto add_all = [&](const auto& values) {
    const std::uint64_t count = values.size();
    add(&count, sizeof(count));
    add(values.data(), values.size() * sizeof(values[0]));
  };
  const Cloud& cloud = level.cloud;
  add_all(cloud.center);
  add_all(cloud.radius);
  add_all(cloud.threshold);
  add_all(level.normal);
  add_all(level.depth);
  add_all(level.photo_begin);
  add_all(level.photo_idx);
  const std::array<double, 6> numbers = {cloud.frame.origin.x, cloud.frame.origin.y,
                                         cloud.frame.origin.z, cloud.frame.unit,
                                         cloud.uniform_radius, level.stats.spacing};
  add(numbers.data(), sizeof(numbers));
  return hash;
}

}  // namespace sherd
