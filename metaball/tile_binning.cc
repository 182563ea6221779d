#include "metaball/tile_binning.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <limits>
#include <utility>

#include "metaball/error.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kSmallestPart = 65536;  // metaballs that are worth a part of their own
constexpr std::size_t kBlock = 16384;         // metaballs between two looks at the stop signal
constexpr std::int64_t kTilesPerTask = 64;

template <class T>
std::size_t BytesOf(const std::vector<T>& v) {
  return v.capacity() * sizeof(T);
}

// Front, then place in the cloud. Fronts are not negative: their bits are in their order.
std::uint64_t KeyOf(const TileEntry& e) {
  return static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(e.front)) << 32 | e.metaball;
}
bool Nearer(const TileEntry& a, const TileEntry& b) { return KeyOf(a) < KeyOf(b); }

// Nearest front first. By the leading 16 bits in which the list's fronts differ, a byte at a time;
// what is equal in these is seldom more than a pair.
void SortByFront(TileEntry* entries, std::size_t count, std::vector<TileEntry>* scratch) {
  constexpr std::size_t kFew = 24;
  if (count <= kFew) {
    std::sort(entries, entries + count, Nearer);
    return;
  }
  const auto bits = [](const TileEntry& e) { return std::bit_cast<std::uint32_t>(e.front); };
  std::uint32_t least = bits(entries[0]), most = least;
  for (std::size_t k = 1; k < count; ++k) {
    least = std::min(least, bits(entries[k]));
    most = std::max(most, bits(entries[k]));
  }
  const int shift = std::max(0, static_cast<int>(std::bit_width(most - least)) - 16);
  const auto key = [&](const TileEntry& e) { return (bits(e) - least) >> shift; };
  std::array<std::uint32_t, 256> low{}, high{};
  for (std::size_t k = 0; k < count; ++k) {
    ++low[key(entries[k]) & 255];
    ++high[key(entries[k]) >> 8];
  }
  std::uint32_t low_sum = 0, high_sum = 0;
  for (int digit = 0; digit < 256; ++digit) {
    low_sum += std::exchange(low[digit], low_sum);
    high_sum += std::exchange(high[digit], high_sum);
  }
  if (scratch->size() < count) scratch->resize(2 * count);
  TileEntry* sorted = scratch->data();
  for (std::size_t k = 0; k < count; ++k) sorted[low[key(entries[k]) & 255]++] = entries[k];
  for (std::size_t k = 0; k < count; ++k) entries[high[key(sorted[k]) >> 8]++] = sorted[k];
  for (std::size_t begin = 0; begin < count;) {
    std::size_t end = begin + 1;
    while (end < count && key(entries[end]) == key(entries[begin])) ++end;
    if (end - begin > 1) std::sort(entries + begin, entries + end, Nearer);
    begin = end;
  }
}

}  // namespace

std::size_t TileBins::MemoryBytes() const {
  return BytesOf(front_) + BytesOf(box_) + BytesOf(next_) + BytesOf(begin_) + BytesOf(entries_);
}

template <class Visit>
void TileBins::ForEachTile(std::size_t begin, std::size_t end, const Visit& visit) const {
  for (std::size_t i = begin; i < end; ++i) {
    const TileBox box = box_[i];
    for (int y = box.y0; y < box.y1; ++y) {
      for (int x = box.x0; x < box.x1; ++x) {
        visit(static_cast<std::size_t>(y) * tiles_x_ + x, static_cast<std::uint32_t>(i));
      }
    }
  }
}

void TileBins::Build(const Cloud& cloud, float radius_scale, const ViewF& view, int threads,
                     const Control& control) {
  const std::size_t n = cloud.size();
  width_ = view.width;
  height_ = view.height;
  tiles_x_ = (view.width + kTileSize - 1) / kTileSize;
  tiles_y_ = (view.height + kTileSize - 1) / kTileSize;
  const std::size_t tiles = static_cast<std::size_t>(tiles_x_) * tiles_y_;
  front_.resize(n);
  box_.resize(n);

  // Every part of the cloud counts for itself what it puts into each tile, and then writes it to a
  // place of its own: no part waits for another. A cloud lies in Morton order, so that what follows
  // each other goes to few tiles.
  const std::size_t parts =
      std::max<std::size_t>(1, std::min<std::size_t>(ThreadCount(threads), n / kSmallestPart));
  const auto part_begin = [&](std::size_t p) { return n * p / parts; };
  const auto for_each_block = [&](std::int64_t part, const auto& block) {
    const std::size_t end = part_begin(part + 1);
    for (std::size_t b = part_begin(part); b < end; b += kBlock) {
      control.ThrowIfStopped();
      block(b, std::min(end, b + kBlock));
    }
  };
  next_.assign(parts * tiles, 0);
  std::atomic<std::uint64_t> in_view{0}, total{0};
  ParallelFor(static_cast<std::int64_t>(parts), threads, [&](std::int64_t part, int) {
    std::uint32_t* counts = next_.data() + part * tiles;
    std::uint64_t seen = 0, sum = 0;
    for_each_block(part, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        float front = 0.0f;
        const PixelBox box =
            BoundsOfSphere(view, cloud.center[i], cloud.RadiusOf(i) * radius_scale, &front);
        box_[i] = {};
        if (box.empty()) continue;
        ++seen;
        front_[i] = std::max(front, 0.0f);
        box_[i] = {static_cast<std::uint16_t>(box.x0 / kTileSize),
                   static_cast<std::uint16_t>(box.y0 / kTileSize),
                   static_cast<std::uint16_t>((box.x1 - 1) / kTileSize + 1),
                   static_cast<std::uint16_t>((box.y1 - 1) / kTileSize + 1)};
      }
      ForEachTile(begin, end, [&](std::size_t tile, std::uint32_t) {
        ++counts[tile];
        ++sum;
      });
    });
    in_view += seen;
    total += sum;
  });
  metaballs_in_view_ = in_view;
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw ResourceError("the picture needs " + std::to_string(total.load()) +
                            " metaball-tile entries, more than one frame can hold; render it in "
                            "parts or with smaller radii",
                        total * sizeof(TileEntry),
                        std::numeric_limits<std::uint32_t>::max() * sizeof(TileEntry));
  }

  begin_.resize(tiles + 1);
  std::uint32_t sum = 0;
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    begin_[tile] = sum;
    for (std::size_t part = 0; part < parts; ++part) {
      std::uint32_t& slot = next_[part * tiles + tile];
      const std::uint32_t count = slot;
      slot = sum;
      sum += count;
    }
  }
  begin_[tiles] = sum;
  entries_.resize(sum);
  ParallelFor(static_cast<std::int64_t>(parts), threads, [&](std::int64_t part, int) {
    std::uint32_t* next = next_.data() + part * tiles;
    for_each_block(part, [&](std::size_t begin, std::size_t end) {
      ForEachTile(begin, end, [&](std::size_t tile, std::uint32_t i) {
        entries_[next[tile]++] = {i, front_[i]};
      });
    });
  });

  const auto all_tiles = static_cast<std::int64_t>(tiles);
  ParallelFor(
      (all_tiles + kTilesPerTask - 1) / kTilesPerTask, threads, [&](std::int64_t task, int) {
        control.ThrowIfStopped();
        std::vector<TileEntry> scratch;
        for (std::int64_t tile = task * kTilesPerTask;
             tile < std::min(all_tiles, (task + 1) * kTilesPerTask); ++tile) {
          SortByFront(entries_.data() + begin_[tile], begin_[tile + 1] - begin_[tile], &scratch);
        }
      });
}

}  // namespace sherd
