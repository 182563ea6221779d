#include "metaball/support_index.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "metaball/median.h"

namespace sherd {

SupportIndex::SupportIndex(const Cloud& cloud, float margin, float widening) {
  if (cloud.empty()) {
    table_.resize(16);
    return;
  }
  const Box3f box = cloud.CenterBox();
  const auto reach = [&](std::size_t i) { return widening * cloud.RadiusOf(i) + margin; };
  std::vector<float> radii;
  radii.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) radii.push_back(reach(i));
  const float largest = *std::max_element(radii.begin(), radii.end());
  const Vec3f size = box.max - box.min;
  const float extent = std::max({size.x, size.y, size.z}) + 2 * largest;
  // At most 2^20 cells on a side; and the largest support spans at most a few dozen of them.
  const float cell = std::max({2.0f * Median(std::move(radii)), extent * 0x1p-20f, largest / 16});
  inverse_cell_ = 1 / cell;
  min_ = box.min - Vec3f{largest + cell, largest + cell, largest + cell};

  const auto for_cells = [&](std::size_t i, const auto& visit) {
    const float r = reach(i);
    const Vec3f lo = (cloud.center[i] - min_ - Vec3f{r, r, r}) * inverse_cell_;
    const Vec3f hi = (cloud.center[i] - min_ + Vec3f{r, r, r}) * inverse_cell_;
    for (int z = static_cast<int>(lo.z); z <= static_cast<int>(hi.z); ++z) {
      for (int y = static_cast<int>(lo.y); y <= static_cast<int>(hi.y); ++y) {
        for (int x = static_cast<int>(lo.x); x <= static_cast<int>(hi.x); ++x) {
          // The part of the box that the sphere does not reach.
          const auto gap = [&](float c, int k) {
            const float a = static_cast<float>(k) * cell, b = a + cell;
            return c < a ? a - c : c > b ? c - b : 0.0f;
          };
          const Vec3f c = cloud.center[i] - min_;
          const Vec3f d{gap(c.x, x), gap(c.y, y), gap(c.z, z)};
          if (Dot(d, d) <= r * r * 1.0001f) visit(SupportIndexView::KeyOf(x, y, z));
        }
      }
    }
  };
  // Count, place, fill.
  // Metaballs that make a surface fill a tenth as many cells; where they lie apart, the table
  // grows.
  std::size_t capacity = 1024;
  while (capacity < cloud.size() / 4) capacity *= 2;
  table_.resize(capacity);
  std::size_t used = 0;
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for_cells(i, [&](std::uint64_t key) {
      std::size_t slot = view().Find(key);
      if (table_[slot].key == 0) {
        if (2 * (used + 1) > table_.size()) {
          std::vector<Slot> old(table_.size() * 2);
          old.swap(table_);
          for (const Slot& s : old) {
            if (s.key != 0) table_[view().Find(s.key)] = s;
          }
          slot = view().Find(key);
        }
        table_[slot].key = key;
        ++used;
      }
      ++table_[slot].end;
      ++total;
    });
  }
  entries_.resize(total);
  std::uint32_t begin = 0;
  for (Slot& slot : table_) {
    const std::uint32_t count = slot.end;
    slot.begin = slot.end = begin;
    begin += count;
  }
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for_cells(i, [&](std::uint64_t key) {
      entries_[table_[view().Find(key)].end++] = static_cast<std::uint32_t>(i);
    });
  }
}

}  // namespace sherd
