// Which metaballs' supports hold a point. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/cloud.h"

namespace sherd {

// Cells of the size of a typical support, each with the metaballs that reach into it.
class SupportIndex {
 public:
  // Supports are taken `widening` times as wide; margin: how far centres may move afterwards, local
  // units.
  explicit SupportIndex(const Cloud& cloud, float margin = 0.0f, float widening = 1.0f);

  // The metaballs whose support may hold `p` (local units): a superset, in ascending order.
  struct Range {
    const std::uint32_t* begin = nullptr;
    const std::uint32_t* end = nullptr;
  };
  Range At(const Vec3f& p) const;

 private:
  struct Slot {
    std::uint64_t key = 0;  // 0: empty
    std::uint32_t begin = 0, end = 0;
  };
  std::uint64_t KeyOf(int x, int y, int z) const;
  std::size_t Find(std::uint64_t key) const;

  Vec3f min_{};
  float inverse_cell_ = 1;
  std::vector<Slot> table_;
  std::vector<std::uint32_t> entries_;
};

}  // namespace sherd
