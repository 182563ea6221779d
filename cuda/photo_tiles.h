// Photographs in a machine's memory (machine.h) within a bound: a pool of tiles that keeps what was
// looked at last.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cuda/kernels/photo_tiles.h"
#include "cuda/machine.h"
#include "metaball/color.h"
#include "metaball/control.h"
#include "metaball/error.h"
#include "metaball/photo/photo_shader.h"
#include "metaball/photo/pyramid.h"

namespace sherd {

template <class Machine>
class PhotoTiles {
 public:
  static constexpr std::uint64_t kTileBytes = kernels::kTilePixels * sizeof(Rgb8);
  // A footprint is at most ten pixels of its level across, its surroundings four pixels of each of
  // two levels: four tiles around a corner, three times.
  static constexpr std::uint64_t kTilesOfOneLookup = 12;

  // pool_bytes: of pixels held at any time. Throws ResourceError where those of a single lookup
  // would not fit.
  PhotoTiles(std::uint64_t pool_bytes, const std::string& memory_name)
      : most_slots_(std::min<std::uint64_t>(pool_bytes / kTileBytes, kMostSlots)) {
    if (most_slots_ < kTilesOfOneLookup) {
      throw ResourceError("the store of photographs needs " +
                              std::to_string(kTilesOfOneLookup * kTileBytes) + " bytes of " +
                              memory_name + "; it may use " + std::to_string(pool_bytes),
                          kTilesOfOneLookup * kTileBytes, pool_bytes);
    }
  }

  std::uint64_t pool_bytes() const { return slot_tile_.size() * kTileBytes; }
  std::uint64_t held() const { return slot_tile_.size() - free_.size(); }
  std::uint64_t loaded() const { return loaded_; }  // since the beginning
  std::uint64_t rounds() const { return round_; }

  // Whose photographs are looked up from now on; what is held of them stays.
  void Use(std::span<const PhotoCamera> cameras, Machine* machine) {
    std::vector<LevelSize> sizes;
    for (const PhotoCamera& camera : cameras) {
      sizes.push_back(camera.usable ? LevelSize{camera.width, camera.height} : LevelSize{0, 0});
    }
    // One that cannot be read any more keeps its tiles.
    const bool same = sizes.size() == sizes_.size() &&
                      std::equal(sizes.begin(), sizes.end(), sizes_.begin(),
                                 [](const LevelSize& now, const LevelSize& before) {
                                   return now.width == 0 || (now.width == before.width &&
                                                             now.height == before.height);
                                 });
    if (same) return;
    sizes_.clear();
    photos_.clear();
    std::uint64_t tiles = 0;
    for (const LevelSize& size : sizes) photos_.push_back(Layout(size, &tiles));
    if (tiles >= kernels::TileState::kWanted) {
      throw ResourceError("the photographs have more tiles than can be numbered", tiles,
                          kernels::TileState::kWanted);
    }
    with_tiles_.clear();
    for (std::size_t i = 0; i < photos_.size(); ++i) {
      if (photos_[i].coarsest >= 0) with_tiles_.push_back(i);
    }
    free_.resize(slot_tile_.size());
    std::iota(free_.begin(), free_.end(), 0u);
    std::ranges::fill(slot_tile_, kFree);
    machine->ResizeExactly(&state_, tiles, "tiles");
    machine->Fill(&state_, tiles, 0, "tiles", [](std::size_t) {
      return kernels::TileState{kernels::TileState::kNone, 0};
    });
    machine->Resize(&counters_, 1, "counters");
    machine->Resize(&linear_, 256, "tables");
    machine->Upload(&linear_, 0, SrgbToLinearTable(), 256);
    UploadPhotos(machine);
    sizes_ = std::move(sizes);
  }

  // For a round of lookups.
  kernels::PhotoTilesView BeginRound() {
    ++round_;
    return {photo_.data(), state_.data(), {chunk_of_.data()}, linear_.data(), round_};
  }

  // Loads what the round asked for and did not find. False where it does not fit beside what the
  // round did find: nothing is loaded then, and nothing asked for any more.
  bool Load(PhotoPixels* pixels, const Control& control, Machine* machine) {
    const std::vector<std::uint32_t> wanted = Wanted(machine);
    Grow(held() + wanted.size(), machine);
    if (wanted.size() > free_.size() && !Evict(wanted.size(), machine)) return false;
    // By photograph; tiles are numbered through.
    std::vector<PhotoRequest> requests;
    std::vector<std::span<const std::uint32_t>> tiles;
    for (std::size_t begin = 0; begin < wanted.size();) {
      const auto photo = static_cast<std::uint32_t>(PhotoOf(wanted[begin]));
      std::size_t end = begin + 1;
      while (end < wanted.size() && PhotoOf(wanted[end]) == photo) ++end;
      requests.push_back({photo, LevelOf(photos_[photo], wanted[begin])});
      tiles.push_back(std::span(wanted).subspan(begin, end - begin));
      begin = end;
    }
    pixels->Fetch(
        requests,
        [&](std::size_t i, const PhotoPyramid* pyramid) {
          kernels::TiledPhoto& photo = photos_[requests[i].photo];
          if (!pyramid) {
            photo.finest = photo.coarsest + 1;
            return;
          }
          // Coarser than asked for: there is nothing finer to be had.
          if (pyramid->finest() > requests[i].finest) {
            photo.finest = std::max(photo.finest, std::min(pyramid->finest(), photo.coarsest));
          }
          Place(photo, *pyramid, tiles[i], machine);
        },
        control);
    UploadPhotos(machine);
    return true;
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  static constexpr std::size_t kStagedTiles = 128;
  static constexpr std::uint32_t kFree = kernels::TileState::kNone;
  static constexpr std::uint64_t kMostSlots = (std::uint64_t{1} << 21) - 1;  // 24 GiB; lists of
                                                                             // them go as one row

  static kernels::TiledPhoto Layout(const LevelSize& size, std::uint64_t* tiles) {
    kernels::TiledPhoto photo{};
    if (size.width == 0) {
      photo.finest = 0;
      photo.coarsest = -1;
      return photo;
    }
    const std::vector<LevelSize> sizes = LevelSizes(size.width, size.height);
    const int levels = std::min(static_cast<int>(sizes.size()), kernels::TiledPhoto::kMostLevels);
    for (int level = 0; level < levels; ++level) {
      const auto [width, height] = sizes[static_cast<std::size_t>(level)];
      const auto columns = static_cast<std::uint32_t>((width - 1) / kernels::kTileSide + 1);
      const auto rows = static_cast<std::uint32_t>((height - 1) / kernels::kTileSide + 1);
      photo.level[level] = {width, height, static_cast<std::uint32_t>(*tiles), columns};
      *tiles += std::uint64_t{columns} * rows;
    }
    photo.coarsest = levels - 1;
    return photo;
  }
  std::size_t PhotoOf(std::uint32_t tile) const {
    // The last that begins at the tile or before; those without tiles begin nowhere.
    const auto first_tile = [this](std::size_t i) { return photos_[i].level[0].first_tile; };
    return *std::prev(std::ranges::upper_bound(with_tiles_, tile, {}, first_tile));
  }
  // Of the photograph's tiles.
  static int LevelOf(const kernels::TiledPhoto& photo, std::uint32_t tile) {
    int level = 0;
    while (level < photo.coarsest && tile >= photo.level[level + 1].first_tile) ++level;
    return level;
  }

  void UploadPhotos(Machine* machine) {
    machine->ResizeExactly(&photo_, photos_.size(), "tiles");
    machine->Upload(&photo_, 0, photos_.data(), photos_.size());
  }

  // What was asked for, ascending: of more than the pool can hold some only.
  std::vector<std::uint32_t> Wanted(Machine* machine) {
    const auto room =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(most_slots_ + 1, state_.size()));
    machine->Resize(&list_, room, "tiles");
    machine->Zero(&counters_, 1);
    machine->ForEach("CollectWanted", state_.size(),
                     kernels::CollectWanted{state_.data(), list_.data(), room, counters_.data()});
    std::uint32_t count = 0;
    machine->Download(&count, counters_, 1);
    std::vector<std::uint32_t> wanted(std::min(count, room));
    if (!wanted.empty()) {
      machine->DownloadRect(wanted.data(), wanted.size(), list_, 0, wanted.size(),
                            static_cast<int>(wanted.size()), 1);
    }
    std::sort(wanted.begin(), wanted.end());
    return wanted;
  }

  // Makes `count` slots free by giving up what was looked at longest ago; false where that takes
  // tiles of this round.
  bool Evict(std::size_t count, Machine* machine) {
    std::vector<std::uint32_t> slots, tiles;
    for (std::uint32_t slot = 0; slot < slot_tile_.size(); ++slot) {
      if (slot_tile_[slot] == kFree) continue;
      slots.push_back(slot);
      tiles.push_back(slot_tile_[slot]);
    }
    const std::size_t missing = count - free_.size();
    if (missing > slots.size()) return false;
    UploadList(tiles, machine);
    machine->Resize(&used_, tiles.size(), "tiles");
    machine->ForEach("GatherUses", tiles.size(),
                     kernels::GatherUses{state_.data(), list_.data(), used_.data()});
    std::vector<std::uint32_t> used(tiles.size());
    machine->DownloadRect(used.data(), used.size(), used_, 0, used.size(),
                          static_cast<int>(used.size()), 1);
    std::vector<std::size_t> order(slots.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto older = [&](std::size_t a, std::size_t b) {
      return used[a] != used[b] ? used[a] < used[b] : slots[a] < slots[b];
    };
    const auto last = order.begin() + static_cast<std::ptrdiff_t>(missing);
    std::nth_element(order.begin(), last - 1, order.end(), older);
    if (used[*(last - 1)] == round_) return false;
    std::vector<std::uint32_t> dropped;
    for (auto it = order.begin(); it != last; ++it) dropped.push_back(tiles[*it]);
    UploadList(dropped, machine);
    machine->ForEach("DropTiles", dropped.size(), kernels::DropTiles{list_.data(), state_.data()});
    for (auto it = order.begin(); it != last; ++it) {
      free_.push_back(slots[*it]);
      slot_tile_[slots[*it]] = kFree;
    }
    return true;
  }

  void UploadList(const std::vector<std::uint32_t>& tiles, Machine* machine) {
    machine->Resize(&list_, tiles.size(), "tiles");
    machine->Upload(&list_, 0, tiles.data(), tiles.size());
  }

  // Those of the tiles that the pyramid has, into free slots.
  void Place(const kernels::TiledPhoto& photo, const PhotoPyramid& pyramid,
             std::span<const std::uint32_t> tiles, Machine* machine) {
    while (!tiles.empty() && LevelOf(photo, tiles.front()) < pyramid.finest()) {
      tiles = tiles.subspan(1);
    }
    machine->Resize(&staged_, kStagedTiles * kernels::kTilePixels, "tiles");
    machine->Resize(&staged_slots_, kStagedTiles, "tiles");
    for (std::size_t begin = 0; begin < tiles.size(); begin += kStagedTiles) {
      const std::size_t count = std::min(kStagedTiles, tiles.size() - begin);
      const auto slots = std::span(free_).last(count);
      staging_.assign(count * kernels::kTilePixels, {});
      for (std::size_t i = 0; i < count; ++i) {
        CopyTile(photo, pyramid, tiles[begin + i], &staging_[i * kernels::kTilePixels]);
      }
      machine->Upload(&staged_, 0, staging_.data(), staging_.size());
      machine->Upload(&staged_slots_, 0, slots.data(), count);
      machine->Resize(&list_, count, "tiles");
      machine->Upload(&list_, 0, &tiles[begin], count);
      machine->ForEach("PlaceTiles", staging_.size(),
                       kernels::PlaceTiles{staged_.data(),
                                           list_.data(),
                                           staged_slots_.data(),
                                           {chunk_of_.data()},
                                           state_.data(),
                                           round_});
      // Only what is on its way is held: a launch that throws leaves the slots free.
      for (std::size_t i = 0; i < count; ++i) slot_tile_[slots[i]] = tiles[begin + i];
      free_.resize(free_.size() - count);
      loaded_ += count;
    }
  }

  static void CopyTile(const kernels::TiledPhoto& photo, const PhotoPyramid& pixels,
                       std::uint32_t tile, Rgb8* out) {
    const int level = LevelOf(photo, tile);
    const kernels::TiledLevel& tiled = photo.level[level];
    const PhotoLevel& source = pixels.levels()[static_cast<std::size_t>(level - pixels.finest())];
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
  void Grow(std::uint64_t tiles, Machine* machine) {
    tiles = std::max(std::min(tiles, most_slots_), kTilesOfOneLookup);
    while (slot_tile_.size() < tiles) {
      const std::uint64_t chunk_tiles = std::min<std::uint64_t>(
          std::uint64_t{1} << kernels::kChunkBits, most_slots_ - slot_tile_.size());
      const bool enough = slot_tile_.size() >= kTilesOfOneLookup;
      if (enough && machine->AvailableBytes() < chunk_tiles * kTileBytes) return;
      try {
        AddChunk(chunk_tiles, machine);
      } catch (const ResourceError&) {
        if (!enough) throw;
        return;
      }
    }
  }
  void AddChunk(std::uint64_t chunk_tiles, Machine* machine) {
    machine->ResizeExactly(&chunk_of_, (kMostSlots >> kernels::kChunkBits) + 1, "tiles");
    Buffer<Rgb8> chunk;
    machine->ResizeExactly(&chunk, chunk_tiles * kernels::kTilePixels, "photographs");
    std::vector<Rgb8*> pointers;
    for (Buffer<Rgb8>& held : chunks_) pointers.push_back(held.data());
    pointers.push_back(chunk.data());
    machine->Upload(&chunk_of_, 0, pointers.data(), pointers.size());
    chunks_.push_back(std::move(chunk));
    for (std::uint64_t i = 0; i < chunk_tiles; ++i) {
      free_.push_back(static_cast<std::uint32_t>(slot_tile_.size()));
      slot_tile_.push_back(kFree);
    }
  }

  std::uint64_t most_slots_;
  std::uint32_t round_ = 0;
  std::uint64_t loaded_ = 0;
  // The photographs' sizes, 0 x 0 where there is none, and their tiles.
  std::vector<LevelSize> sizes_;
  std::vector<kernels::TiledPhoto> photos_;
  std::vector<std::size_t> with_tiles_;
  // The pool: what tile each slot holds, and those that are kFree.
  std::vector<Buffer<Rgb8>> chunks_;
  std::vector<std::uint32_t> slot_tile_, free_;
  // What the kernels read and write.
  Buffer<kernels::TiledPhoto> photo_;
  Buffer<kernels::TileState> state_;
  Buffer<Rgb8*> chunk_of_;
  Buffer<float> linear_;
  Buffer<std::uint32_t> counters_, list_, used_, staged_slots_;
  Buffer<Rgb8> staged_;
  std::vector<Rgb8> staging_;
};

}  // namespace sherd
