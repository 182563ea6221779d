// Which metaballs' supports hold a point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// The index to look up in, on the CPU and on the GPU: a hash table of cells, open addressing.
struct SupportIndexView {
  struct Slot {
    std::uint64_t key = 0;  // 0: empty
    std::uint32_t begin = 0, end = 0;
  };
  struct Range {
    const std::uint32_t* begin = nullptr;
    const std::uint32_t* end = nullptr;
  };

  Vec3f min{};
  float inverse_cell = 1;
  const Slot* table = nullptr;
  std::size_t slots = 0;  // a power of two
  const std::uint32_t* entries = nullptr;
  std::size_t entry_count = 0;

  // The metaballs whose support may hold `p` (local units): a superset, in ascending order.
  SHERD_HD Range At(const Vec3f& p) const {
    const Vec3f q = (p - min) * inverse_cell;
    if (!(q.x >= 0 && q.y >= 0 && q.z >= 0 && q.x < 0x1p21f && q.y < 0x1p21f && q.z < 0x1p21f)) {
      return {};
    }
    const Slot& slot =
        table[Find(KeyOf(static_cast<int>(q.x), static_cast<int>(q.y), static_cast<int>(q.z)))];
    if (slot.key == 0) return {};
    return {entries + slot.begin, entries + slot.end};
  }

  SHERD_HD static std::uint64_t KeyOf(int x, int y, int z) {
    return (static_cast<std::uint64_t>(x) << 42 | static_cast<std::uint64_t>(y) << 21 |
            static_cast<std::uint64_t>(z)) +
           1;
  }
  // The slot that holds the key, or would.
  SHERD_HD std::size_t Find(std::uint64_t key) const {
    const std::size_t mask = slots - 1;
    const std::uint64_t hash = key * 0x9e3779b97f4a7c15ull;
    std::size_t slot = static_cast<std::size_t>(hash >> 20) & mask;
    while (table[slot].key != 0 && table[slot].key != key) slot = (slot + 1) & mask;
    return slot;
  }
};

// Cells of the size of a typical support, each with the metaballs that reach into it.
class SupportIndex {
 public:
  // Supports are taken `widening` times as wide; margin: how far centres may move afterwards, local
  // units.
  explicit SupportIndex(const Cloud& cloud, float margin = 0.0f, float widening = 1.0f);

  using Range = SupportIndexView::Range;
  Range At(const Vec3f& p) const { return view().At(p); }
  // Valid while the index lives.
  SupportIndexView view() const {
    return {min_, inverse_cell_, table_.data(), table_.size(), entries_.data(), entries_.size()};
  }

 private:
  using Slot = SupportIndexView::Slot;

  Vec3f min_{};
  float inverse_cell_ = 1;
  std::vector<Slot> table_;
  std::vector<std::uint32_t> entries_;
};

}  // namespace sherd
