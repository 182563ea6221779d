#include "metaball/thesis/octree.h"

#include <algorithm>
#include <bit>
#include <new>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

template <class T>
std::size_t BytesOf(const std::vector<T>& v) {
  return v.capacity() * sizeof(T);
}

// A node's place among those of its own depth.
std::size_t PlaceOf(std::uint32_t key_node, int depth) {
  return OctreeNodeIndex(key_node, depth) - OctreeNodesAbove(depth);
}

}  // namespace

void MortonOctree::Build(const Cloud& cloud, double margin, int depth, const Control& control) {
  depth_ = depth;
  const Box3f box = cloud.CenterBox();
  const Vec3d min = box.min.cast<double>(), max = box.max.cast<double>();
  const Vec3d extent = max - min;
  // A factor keeps the highest centre inside the last cell rather than on its far side.
  size_ = (std::max({extent.x, extent.y, extent.z}) + 2 * margin) * (1 + 1e-6);
  if (!(size_ > 0)) size_ = 1.0;
  corner_ = (min + max) * 0.5 - Vec3d{size_, size_, size_} * 0.5;

  const std::size_t finest = std::size_t{1} << (3 * depth);
  const std::size_t words = (finest + 63) / 64;
  const std::size_t near_words = (OctreeNodesAbove(depth + 1) + 63) / 64;
  try {
    near_.assign(near_words, 0);
    held_.assign(words, 0);
    held_before_.assign(words, 0);
  } catch (const std::bad_alloc&) {
    const std::size_t bytes = (near_words + words) * 8 + words * 4;
    throw ResourceError("an octree of depth " + std::to_string(depth) + " needs " +
                            std::to_string(bytes >> 20) + " MB of memory; take a lower depth",
                        bytes, 0);
  }

  std::vector<std::pair<std::uint32_t, std::uint32_t>> sorted(cloud.size());
  for (std::uint32_t i = 0; i < cloud.size(); ++i) {
    const std::uint32_t key = OctreeKey(CellOf(cloud.center[i].cast<double>()));
    sorted[i] = {NodeOfKey(key, depth), i};
  }
  control.ThrowIfStopped();
  std::sort(sorted.begin(), sorted.end());
  begin_.clear();
  metaball_.clear();
  metaball_.reserve(sorted.size());
  for (std::size_t k = 0; k < sorted.size(); ++k) {
    const auto [node, idx] = sorted[k];
    if (k == 0 || sorted[k - 1].first != node) {
      if ((begin_.size() & 0x3fff) == 0) control.ThrowIfStopped();
      begin_.push_back(static_cast<std::uint32_t>(k));
      const std::size_t place = PlaceOf(node, depth);
      held_[place / 64] |= std::uint64_t{1} << (place % 64);
      for (int offset = 0; offset < 27; ++offset) {
        const std::uint32_t near =
            OctreeNeighbour(node, depth, offset % 3 - 1, offset / 3 % 3 - 1, offset / 9 - 1);
        if (near == kOctreeOutside) continue;
        // Up to the root, or to where another node has already been.
        for (int d = depth; d >= 0; --d) {
          const std::size_t i = OctreeNodeIndex(NodeOfKey(near, d), d);
          const std::uint64_t bit = std::uint64_t{1} << (i % 64);
          if (near_[i / 64] & bit) break;
          near_[i / 64] |= bit;
        }
      }
    }
    metaball_.push_back(idx);
  }
  begin_.push_back(static_cast<std::uint32_t>(sorted.size()));
  std::uint32_t before = 0;
  for (std::size_t w = 0; w < words; ++w) {
    held_before_[w] = before;
    before += static_cast<std::uint32_t>(std::popcount(held_[w]));
  }
}

std::size_t MortonOctree::MemoryBytes() const {
  return BytesOf(near_) + BytesOf(held_) + BytesOf(held_before_) + BytesOf(begin_) +
         BytesOf(metaball_);
}

}  // namespace sherd
