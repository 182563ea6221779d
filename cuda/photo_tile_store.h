// Photographs on a machine (machine.h) within a bound of memory: a pool of tiles that keeps what
// was looked at last. Included by host_loop.cc and photo_sampler.cu.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cuda/kernels/photo_tiles.h"
#include "cuda/machine.h"
#include "cuda/photo_sampler.h"
#include "cuda/tile_slots.h"
#include "metaball/error.h"

namespace sherd {

template <class Machine>
class PhotoTileStore final : public PhotoTileSampler {
 public:
  // pool_bytes: of pixels held at any time; about 8 MB of buffers and the numbers of a photograph's
  // tiles come on top. Throws ResourceError where a single lookup's tiles would not fit.
  PhotoTileStore(Machine machine, std::uint64_t pool_bytes)
      : machine_(std::move(machine)), most_slots_(pool_bytes / kTileBytes) {
    if (most_slots_ < kTilesOfOneLookup) {
      throw ResourceError("the store of photographs needs " +
                              std::to_string(kTilesOfOneLookup * kTileBytes) + " bytes of " +
                              machine_.memory_name() + "; it may use " + std::to_string(pool_bytes),
                          kTilesOfOneLookup * kTileBytes, pool_bytes);
    }
  }

  bool NeedsPixels(const PhotoExtent& extent, std::span<const PhotoLookup> lookups,
                   const Control& control) override {
    machine_.BeginFrame(control.stop, 0);
    const kernels::TiledPhoto photo = Layout(extent, extent.finest);
    bool all_held = true;
    for (std::size_t begin = 0; begin < lookups.size() && all_held; begin += kLookupsAtOnce) {
      const std::uint32_t count = UploadLookups(lookups.subspan(begin));
      for (const Need& need : FindNeeds(photo, 0, count)) {
        all_held = all_held && slots_.Holds(KeyOf(extent.photo, need.tile));
      }
    }
    machine_.EndFrame();
    return !all_held;
  }

  void Sample(const PhotoExtent& extent, const PhotoPyramid* pixels,
              std::span<const PhotoLookup> lookups, PhotoColors* colors,
              const Control& control) override {
    machine_.BeginFrame(control.stop, 0);
    const kernels::TiledPhoto photo = Layout(extent, pixels ? pixels->finest() : extent.finest);
    for (std::size_t begin = 0; begin < lookups.size(); begin += kLookupsAtOnce) {
      const std::uint32_t count = UploadLookups(lookups.subspan(begin));
      for (std::uint32_t done = 0; done < count;) {
        control.ThrowIfStopped();
        done = SampleSome(extent.photo, photo, pixels, done, count);
        ++use_.rounds;
      }
      machine_.DownloadRect(colors + begin, count, colors_, 0, count, static_cast<int>(count), 1);
    }
    machine_.EndFrame();
  }

  Use use() const override {
    Use use = use_;
    use.tiles_held = slots_.held();
    use.pool_bytes = slots_.slots() * kTileBytes;
    return use;
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  struct Need {
    std::uint32_t first;  // lookup
    std::uint32_t tile;   // of the photograph
  };

  static constexpr std::uint64_t kTileBytes = kernels::kTilePixels * sizeof(Rgb8);
  // A footprint is at most ten pixels of its level across, its surroundings four pixels of each of
  // two levels: four tiles around a corner, three times.
  static constexpr std::uint64_t kTilesOfOneLookup = 12;
  static constexpr std::uint32_t kLookupsAtOnce = 1 << 16;
  static constexpr std::size_t kStagedTiles = 128;
  static constexpr int kTableRow = 1024;
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  static std::uint64_t KeyOf(std::uint32_t photo, std::uint32_t tile) {
    return std::uint64_t{photo} << 32 | tile;
  }

  // Numbers a tile alike whichever levels are read.
  kernels::TiledPhoto Layout(const PhotoExtent& extent, int finest) {
    kernels::TiledPhoto photo{};
    const std::vector<LevelSize> sizes = LevelSizes(extent.width, extent.height);
    const int levels = std::min(static_cast<int>(sizes.size()), kernels::TiledPhoto::kMostLevels);
    tiles_ = 0;
    for (int level = 0; level < levels; ++level) {
      const auto [width, height] = sizes[static_cast<std::size_t>(level)];
      const auto columns = static_cast<std::uint32_t>((width - 1) / kernels::kTileSide + 1);
      const auto rows = static_cast<std::uint32_t>((height - 1) / kernels::kTileSide + 1);
      photo.level[level] = {width, height, tiles_, columns};
      tiles_ += columns * rows;
    }
    photo.coarsest = levels - 1;
    photo.finest = std::min(finest, photo.coarsest);
    return photo;
  }

  std::uint32_t UploadLookups(std::span<const PhotoLookup> lookups) {
    const auto count =
        static_cast<std::uint32_t>(std::min<std::size_t>(lookups.size(), kLookupsAtOnce));
    if (linear_.size() == 0) {
      machine_.Resize(&lookups_, kLookupsAtOnce, "lookups");
      machine_.Resize(&colors_, kLookupsAtOnce, "colours");
      machine_.Resize(&staged_, kStagedTiles * kernels::kTilePixels, "tiles");
      machine_.Resize(&staged_slots_, kStagedTiles, "tiles");
      machine_.Resize(&linear_, 256, "tables");
      machine_.Upload(&linear_, 0, SrgbToLinearTable(), 256);
    }
    machine_.Upload(&lookups_, 0, lookups.data(), count);
    return count;
  }

  // A number for each of the photograph's tiles, rounded up to whole rows of kTableRow.
  void UploadTable(Buffer<std::uint32_t>* buffer) {
    machine_.Resize(buffer, table_.size(), "tiles");
    machine_.Upload(buffer, 0, table_.data(), table_.size());
  }
  void ClearTable() {
    table_.assign((std::size_t{tiles_} + kTableRow - 1) / kTableRow * kTableRow, kNone);
  }

  // The tiles that lookups begin .. end read, ordered by the first lookup that does.
  std::vector<Need> FindNeeds(const kernels::TiledPhoto& photo, std::uint32_t begin,
                              std::uint32_t end) {
    ClearTable();
    UploadTable(&first_need_);
    machine_.ForEach("photo_mark", end - begin,
                     kernels::MarkTiles{photo, lookups_.data(), begin, first_need_.data()});
    machine_.DownloadRect(table_.data(), kTableRow, first_need_, 0, kTableRow, kTableRow,
                          static_cast<int>(table_.size() / kTableRow));
    std::vector<Need> needs;
    for (std::uint32_t tile = 0; tile < tiles_; ++tile) {
      if (table_[tile] != kNone) needs.push_back({table_[tile], tile});
    }
    std::sort(needs.begin(), needs.end(), [](const Need& a, const Need& b) {
      return a.first != b.first ? a.first < b.first : a.tile < b.tile;
    });
    return needs;
  }

  // Samples as many of the lookups begin .. end as the pool can hold the tiles of together; returns
  // the first one that is left.
  std::uint32_t SampleSome(std::uint32_t id, const kernels::TiledPhoto& photo,
                           const PhotoPyramid* pixels, std::uint32_t begin, std::uint32_t end) {
    std::vector<Need> needs = FindNeeds(photo, begin, end);
    // What is there already goes to the front, so that what follows does not push it out.
    std::size_t missing = 0;
    for (const Need& need : needs) missing += !slots_.Touch(KeyOf(id, need.tile));
    Grow(slots_.held() + missing);
    const std::uint64_t room = slots_.slots();
    if (needs.size() > room) {
      end = needs[room].first;
      if (end == begin) {
        throw ResourceError(
            "a lookup reads more of a photograph than " + machine_.memory_name() + " may hold",
            needs.size() * kTileBytes, room * kTileBytes);
      }
      needs.resize(room);
      for (const Need& need : needs) slots_.Touch(KeyOf(id, need.tile));
    }
    std::vector<std::uint32_t> load;
    for (const Need& need : needs) {
      if (!slots_.Holds(KeyOf(id, need.tile))) load.push_back(need.tile);
    }
    if (!load.empty() && !pixels) throw Error("the pixels of a photograph are missing");
    for (std::size_t i = 0; i < load.size(); i += kStagedTiles) {
      const std::size_t count = std::min(kStagedTiles, load.size() - i);
      Place(id, photo, *pixels, std::span(load).subspan(i, count));
    }
    ClearTable();
    for (const Need& need : needs) table_[need.tile] = slots_.SlotOf(KeyOf(id, need.tile));
    UploadTable(&slot_of_);
    machine_.ForEach("photo_sample", end - begin,
                     kernels::SamplePhoto{photo,
                                          lookups_.data(),
                                          begin,
                                          slot_of_.data(),
                                          {chunk_of_.data()},
                                          linear_.data(),
                                          colors_.data()});
    return end;
  }

  // Loads tiles that are not held, at most kStagedTiles, over those that were used longest ago.
  void Place(std::uint32_t id, const kernels::TiledPhoto& photo, const PhotoPyramid& pixels,
             std::span<const std::uint32_t> tiles) {
    const std::span<const std::uint32_t> slots = slots_.MakeFree(tiles.size());
    std::vector<std::uint64_t> keys;
    staging_.assign(tiles.size() * kernels::kTilePixels, {});
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      CopyTile(photo, pixels, tiles[i], &staging_[i * kernels::kTilePixels]);
      keys.push_back(KeyOf(id, tiles[i]));
    }
    machine_.Upload(&staged_, 0, staging_.data(), staging_.size());
    machine_.Upload(&staged_slots_, 0, slots.data(), slots.size());
    machine_.ForEach("photo_place", staging_.size(),
                     kernels::PlaceTiles{staged_.data(), staged_slots_.data(), {chunk_of_.data()}});
    // Only what is on its way is held: a launch that throws leaves the slots free.
    slots_.Hold(keys);
    use_.tiles_loaded += tiles.size();
  }

  static void CopyTile(const kernels::TiledPhoto& photo, const PhotoPyramid& pixels,
                       std::uint32_t tile, Rgb8* out) {
    int level = photo.finest;
    while (level < photo.coarsest && tile >= photo.level[level + 1].first_tile) ++level;
    const kernels::TiledLevel& tiled = photo.level[level];
    const PhotoLevel& source = pixels.levels()[static_cast<std::size_t>(level - photo.finest)];
    const std::uint32_t in_level = tile - tiled.first_tile;
    const int x0 = static_cast<int>(in_level % tiled.columns) * kernels::kTileSide;
    const int y0 = static_cast<int>(in_level / tiled.columns) * kernels::kTileSide;
    const int width = std::min(kernels::kTileSide, source.width - x0);
    const int height = std::min(kernels::kTileSide, source.height - y0);
    for (int y = 0; y < height; ++y) {
      const std::size_t row = static_cast<std::size_t>(y0 + y) * source.width + x0;
      std::copy_n(&source.pixels[row], width, out + y * kernels::kTileSide);
    }
  }

  // Makes room for `tiles` in all where the bound and the machine's memory let it. Throws
  // ResourceError where they do not even for those of one lookup.
  void Grow(std::uint64_t tiles) {
    tiles = std::max(std::min(tiles, most_slots_), kTilesOfOneLookup);
    bool grown = false;
    while (slots_.slots() < tiles && !full_) {
      const std::uint64_t chunk_tiles =
          std::min(std::uint64_t{1} << kernels::kChunkBits, most_slots_ - slots_.slots());
      Buffer<Rgb8> chunk;
      try {
        machine_.ResizeExactly(&chunk, chunk_tiles * kernels::kTilePixels, "photographs");
      } catch (const ResourceError&) {
        if (slots_.slots() < kTilesOfOneLookup) throw;
        full_ = true;
        break;
      }
      chunks_.push_back(std::move(chunk));
      slots_.AddSlots(chunk_tiles);
      grown = true;
    }
    if (!grown) return;
    std::vector<Rgb8*> pointers;
    for (Buffer<Rgb8>& chunk : chunks_) pointers.push_back(chunk.data());
    machine_.Resize(&chunk_of_, pointers.size(), "tiles");
    machine_.Upload(&chunk_of_, 0, pointers.data(), pointers.size());
  }

  Machine machine_;
  // The pool.
  std::uint64_t most_slots_;
  bool full_ = false;  // the machine's memory is
  std::vector<Buffer<Rgb8>> chunks_;
  TileSlots slots_;
  // What the kernels read and write.
  Buffer<Rgb8*> chunk_of_;
  Buffer<PhotoLookup> lookups_;
  Buffer<PhotoColors> colors_;
  Buffer<std::uint32_t> first_need_, slot_of_, staged_slots_;
  Buffer<Rgb8> staged_;
  Buffer<float> linear_;
  // The photograph at hand: its tiles, and a number for each.
  std::uint32_t tiles_ = 0;
  std::vector<std::uint32_t> table_;
  std::vector<Rgb8> staging_;
  Use use_;
};

}  // namespace sherd
