#include "metaball/tile_binning.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <limits>

#include "metaball/error.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

// Unsigned integers in the order of the floats they come from.
std::uint32_t OrderedKey(float v) {
  const auto bits = std::bit_cast<std::uint32_t>(v);
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

constexpr std::size_t kBlock = 16384;  // metaballs bounded by one task

template <class T>
std::size_t BytesOf(const std::vector<T>& v) {
  return v.capacity() * sizeof(T);
}

}  // namespace

std::size_t TileBins::MemoryBytes() const {
  return BytesOf(front_) + BytesOf(box_) + BytesOf(order_) + BytesOf(scratch_) + BytesOf(begin_) +
         BytesOf(entries_);
}

void TileBins::SortByFront(int threads) {
  // Least significant digit first, 11 bits at a time, over the 32 key bits above the index. Each
  // pass is stable; the input is in index order, so equal fronts keep the cloud's order.
  constexpr int kDigitBits = 11;
  constexpr std::size_t kDigits = 1u << kDigitBits;
  const std::size_t n = order_.size();
  scratch_.resize(n);
  const int parts = std::max(1, std::min(ThreadCount(threads), static_cast<int>(n / 65536) + 1));
  std::vector<std::array<std::uint32_t, kDigits>> histogram(parts);
  for (int shift = 32; shift < 64; shift += kDigitBits) {
    const auto digit = [shift](std::uint64_t v) { return (v >> shift) & (kDigits - 1); };
    const auto part_begin = [&](int p) { return n * static_cast<std::size_t>(p) / parts; };
    ParallelFor(parts, threads, [&](std::int64_t p, int) {
      auto& counts = histogram[p];
      counts.fill(0);
      for (std::size_t i = part_begin(p); i < part_begin(p + 1); ++i) ++counts[digit(order_[i])];
    });
    std::uint32_t sum = 0;
    for (std::size_t d = 0; d < kDigits; ++d) {
      for (auto& counts : histogram) {
        const std::uint32_t count = counts[d];
        counts[d] = sum;
        sum += count;
      }
    }
    ParallelFor(parts, threads, [&](std::int64_t p, int) {
      auto& next = histogram[p];
      for (std::size_t i = part_begin(p); i < part_begin(p + 1); ++i) {
        scratch_[next[digit(order_[i])]++] = order_[i];
      }
    });
    order_.swap(scratch_);
  }
}

void TileBins::Build(const Cloud& cloud, float radius_scale, const ViewF& view, int threads,
                     const Control& control) {
  const std::size_t n = cloud.size();
  tiles_x_ = (view.width + kTileSize - 1) / kTileSize;
  tiles_y_ = (view.height + kTileSize - 1) / kTileSize;
  front_.resize(n);
  box_.resize(n);

  // Bounds of every metaball, and how many there are in each block that are in view.
  const std::size_t blocks = (n + kBlock - 1) / kBlock;
  std::vector<std::size_t> visible(blocks + 1, 0);
  ParallelFor(static_cast<std::int64_t>(blocks), threads, [&](std::int64_t b, int) {
    control.ThrowIfStopped();
    std::size_t count = 0;
    for (std::size_t i = b * kBlock; i < std::min(n, (b + 1) * kBlock); ++i) {
      float front = 0.0f;
      const PixelBox box =
          BoundsOfSphere(view, cloud.center[i], cloud.RadiusOf(i) * radius_scale, &front);
      front_[i] = front;
      box_[i] = {};
      if (box.empty()) continue;
      ++count;
      box_[i] = {static_cast<std::uint16_t>(box.x0 / kTileSize),
                 static_cast<std::uint16_t>(box.y0 / kTileSize),
                 static_cast<std::uint16_t>((box.x1 - 1) / kTileSize + 1),
                 static_cast<std::uint16_t>((box.y1 - 1) / kTileSize + 1)};
    }
    visible[b + 1] = count;
  });
  for (std::size_t b = 0; b < blocks; ++b) visible[b + 1] += visible[b];
  order_.resize(visible[blocks]);
  ParallelFor(static_cast<std::int64_t>(blocks), threads, [&](std::int64_t b, int) {
    std::size_t next = visible[b];
    for (std::size_t i = b * kBlock; i < std::min(n, (b + 1) * kBlock); ++i) {
      if (box_[i].x1 == 0) continue;
      order_[next++] = static_cast<std::uint64_t>(OrderedKey(front_[i])) << 32 | i;
    }
  });
  SortByFront(threads);
  control.ThrowIfStopped();

  // Each band of tile rows belongs to one task, which walks the metaballs nearest first.
  const std::size_t tiles = static_cast<std::size_t>(tiles_x_) * tiles_y_;
  begin_.assign(tiles + 1, 0);
  const int bands = std::min(tiles_y_, 2 * ThreadCount(threads));
  const auto band_begin = [&](std::int64_t b) { return static_cast<int>(b * tiles_y_ / bands); };
  std::atomic<std::uint64_t> total{0};
  const auto for_each_tile = [&](std::int64_t band, const auto& visit) {
    const int row0 = band_begin(band), row1 = band_begin(band + 1);
    for (std::size_t k = 0; k < order_.size(); ++k) {
      if ((k & 0xffff) == 0) control.ThrowIfStopped();
      const auto i = static_cast<std::uint32_t>(order_[k]);
      const TileBox box = box_[i];
      const int y1 = std::min<int>(box.y1, row1);
      for (int y = std::max<int>(box.y0, row0); y < y1; ++y) {
        for (int x = box.x0; x < box.x1; ++x) {
          visit(static_cast<std::size_t>(y) * tiles_x_ + x, i);
        }
      }
    }
  };
  ParallelFor(bands, threads, [&](std::int64_t band, int) {
    std::uint64_t sum = 0;
    for_each_tile(band, [&](std::size_t tile, std::uint32_t) {
      ++begin_[tile + 1];
      ++sum;
    });
    total += sum;
  });
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw ResourceError("the picture needs " + std::to_string(total.load()) +
                            " metaball-tile entries, more than one frame can hold; render it in "
                            "parts or with smaller radii",
                        total * 4, std::numeric_limits<std::uint32_t>::max() * 4ull);
  }
  for (std::size_t t = 0; t < tiles; ++t) begin_[t + 1] += begin_[t];
  entries_.resize(begin_[tiles]);
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  ParallelFor(bands, threads, [&](std::int64_t band, int) {
    for_each_tile(band, [&](std::size_t tile, std::uint32_t i) { entries_[next[tile]++] = i; });
  });
}

}  // namespace sherd
