// From metaballs to sorted lists per screen tile, on whichever machine: the order of the kernels of
// kernels/binning.h and their buffers.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "cuda/kernels/binning.h"
#include "cuda/machine.h"
#include "metaball/camera.h"
#include "metaball/local_view.h"

namespace sherd {

template <class Machine>
class TileLists {
 public:
  // What a metaball takes: box, front, two keys, two items, tiles, offset.
  static constexpr std::uint64_t kBytesPerMetaball = 8 + 4 + 8 + 8 + 4 + 8;
  static constexpr std::uint64_t kBytesPerEntry = 16;  // two keys, two values
  static constexpr std::uint64_t kBytesPerTile = sizeof(kernels::EntryRange);
  static constexpr std::uint64_t kMostEntries = (std::uint64_t{1} << 31) - 1;

  // Everything up to the number of entries, which decides what Fill reserves.
  kernels::BinTotals Count(const kernels::MetaballArrays& metaballs, const Camera& local,
                           Machine* machine) {
    const std::size_t n = metaballs.count;
    machine->Resize(&box_, n, "pixel boxes");
    machine->Resize(&front_, n, "front distances");
    for (auto* sort : {&key_, &item_}) {
      machine->Resize(&sort->content, n, "depth order");
      machine->Resize(&sort->room, n, "depth order");
    }
    machine->Resize(&tile_count_, n + 1, "tile counts");
    machine->Resize(&offset_, n + 1, "offsets");
    machine->Resize(&totals_, 1, "counters");
    machine->Zero(&totals_, 1);
    machine->ForEach("MeasureBounds", n,
                     kernels::MeasureBounds{metaballs, ViewOf(local), box_.data(), front_.data(),
                                            key_.content.data(), item_.content.data()});
    machine->SortPairs("sort by depth", &key_, &item_, n, 32);
    machine->ForEach("CountTiles", n + 1,
                     kernels::CountTiles{metaballs.count, key_.content.data(), item_.content.data(),
                                         box_.data(), tile_count_.data(), totals_.data()});
    machine->ExclusiveSum("scan of tile counts", tile_count_, &offset_, n + 1);
    machine->ForEach("TakeTotal", 1,
                     kernels::TakeTotal{metaballs.count, offset_.data(), totals_.data()});
    kernels::BinTotals totals;
    machine->Download(&totals, totals_, 1);
    return totals;
  }

  void Fill(const Camera& local, const kernels::BinTotals& totals, Machine* machine) {
    tiles_x_ = (local.width + kernels::kTileSize - 1) / kernels::kTileSize;
    tiles_y_ = (local.height + kernels::kTileSize - 1) / kernels::kTileSize;
    for (auto* sort : {&tile_, &entry_}) {
      machine->Resize(&sort->content, totals.entries, "tile lists");
      machine->Resize(&sort->room, totals.entries, "tile lists");
    }
    machine->Resize(&range_, tiles(), "tile ranges");
    machine->Zero(&range_, tiles());
    machine->ForEach("FillEntries", kernels::FillEntries::Threads(totals.entries),
                     kernels::FillEntries{totals.entries, totals.in_view, tiles_x_, offset_.data(),
                                          item_.content.data(), box_.data(), tile_.content.data(),
                                          entry_.content.data()});
    const int bits = std::bit_width(static_cast<unsigned>(std::max(1, tiles() - 1)));
    machine->SortPairs("sort by tile", &tile_, &entry_, totals.entries, bits);
    machine->ForEach("FindRanges", totals.entries,
                     kernels::FindRanges{totals.entries, tile_.content.data(), range_.data()});
  }

  void Release(Machine* machine) {
    machine->Release(&box_);
    machine->Release(&front_);
    machine->Release(&tile_count_);
    machine->Release(&offset_);
    for (auto* sort : {&key_, &item_, &tile_, &entry_}) {
      machine->Release(&sort->content);
      machine->Release(&sort->room);
    }
    machine->Release(&range_);
  }

  int tiles_x() const { return tiles_x_; }
  int tiles_y() const { return tiles_y_; }
  int tiles() const { return tiles_x_ * tiles_y_; }
  const kernels::PixelBox16* boxes() const { return box_.data(); }        // by metaball
  const std::uint32_t* fronts() const { return front_.data(); }           // by metaball
  const std::uint32_t* entries() const { return entry_.content.data(); }  // by tile, by depth
  const kernels::EntryRange* ranges() const { return range_.data(); }     // by tile

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  Buffer<kernels::PixelBox16> box_;
  Buffer<std::uint32_t> front_, tile_count_;
  Buffer<std::uint64_t> offset_;
  SortBuffer<Buffer<std::uint32_t>> key_, item_, tile_, entry_;
  Buffer<kernels::EntryRange> range_;
  Buffer<kernels::BinTotals> totals_;
  int tiles_x_ = 0, tiles_y_ = 0;
};

}  // namespace sherd
