#include "metaball/mesh/block_list.h"

#include <algorithm>
#include <cmath>

#include "metaball/error.h"

namespace sherd {
namespace {

// Block coordinates in 21 bits each, shifted to be positive.
constexpr int kBits = 21;
constexpr std::int64_t kMiddle = std::int64_t{1} << (kBits - 1);
constexpr std::uint64_t kAxisMask = (std::uint64_t{1} << kBits) - 1;
constexpr double kMostEntries = 0x1p28;  // 4 GiB of entries
// A support counts as a little larger, so that rounding cannot leave a metaball out of one of two
// blocks whose common nodes it reaches.
constexpr double kMargin = 1e-9;

std::uint64_t KeyOf(std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto shifted = [](std::int64_t v) { return static_cast<std::uint64_t>(v + kMiddle); };
  return shifted(z) << (2 * kBits) | shifted(y) << kBits | shifted(x);
}

[[noreturn]] void FailTooSmall() {
  throw Error(
      "the cell size is too small for this cloud: its metaballs reach more blocks of cells than "
      "can be counted; choose a larger cell");
}

struct Range {
  std::int64_t low, high;  // both included
};

}  // namespace

BlockList::BlockList(const MeshField& field, const Cloud& cloud, double cell,
                     const Control& control) {
  const double block = cell * kBlockCells;
  const auto range = [&](double center, double support) -> Range {
    const double low = std::ceil((center - support) / block) - 1;
    const double high = std::floor((center + support) / block);
    if (!(low > -static_cast<double>(kMiddle) && high < static_cast<double>(kMiddle) - 1)) {
      FailTooSmall();
    }
    return {static_cast<std::int64_t>(low), static_cast<std::int64_t>(high)};
  };
  const auto ranges = [&](std::size_t i) -> std::array<Range, 3> {
    const double support = field.SupportOf(i) * (1 + kMargin) + kMargin * block;
    const Vec3f& c = cloud.center[i];
    return {range(c.x, support), range(c.y, support), range(c.z, support)};
  };
  double entries = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    double own = 1;
    for (const Range& r : ranges(i)) own *= static_cast<double>(r.high - r.low + 1);
    entries += own;
    if (entries > kMostEntries) FailTooSmall();
  }
  control.ThrowIfStopped();
  struct Entry {
    std::uint64_t key;
    std::uint32_t idx;
    auto operator<=>(const Entry&) const = default;
  };
  std::vector<Entry> all;
  all.reserve(static_cast<std::size_t>(entries));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto [xs, ys, zs] = ranges(i);
    for (std::int64_t z = zs.low; z <= zs.high; ++z) {
      for (std::int64_t y = ys.low; y <= ys.high; ++y) {
        for (std::int64_t x = xs.low; x <= xs.high; ++x) {
          all.push_back({KeyOf(x, y, z), static_cast<std::uint32_t>(i)});
        }
      }
    }
  }
  control.ThrowIfStopped();
  std::sort(all.begin(), all.end());
  control.ThrowIfStopped();
  metaballs_.reserve(all.size());
  for (const Entry& entry : all) {
    if (keys_.empty() || keys_.back() != entry.key) {
      keys_.push_back(entry.key);
      begin_.push_back(metaballs_.size());
    }
    metaballs_.push_back(entry.idx);
  }
  begin_.push_back(metaballs_.size());
}

std::array<std::int64_t, 3> BlockList::PlaceOf(std::size_t block) const {
  const std::uint64_t key = keys_[block];
  const auto axis = [&](int k) {
    return static_cast<std::int64_t>(key >> (k * kBits) & kAxisMask) - kMiddle;
  };
  return {axis(0), axis(1), axis(2)};
}

std::int64_t BlockList::Neighbor(std::size_t block, const std::array<int, 3>& step) const {
  const auto [x, y, z] = PlaceOf(block);
  const std::uint64_t key = KeyOf(x + step[0], y + step[1], z + step[2]);
  const auto found = std::lower_bound(keys_.begin(), keys_.end(), key);
  return found != keys_.end() && *found == key ? found - keys_.begin() : -1;
}

}  // namespace sherd
