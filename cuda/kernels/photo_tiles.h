// Photographs as tiles in a pool: their layout, and the kernels that look colours up in it, gather
// what is missing, and put tiles into the pool.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/kernels/device_ops.h"
#include "metaball/color.h"
#include "metaball/hostdevice.h"
#include "metaball/photo/filter.h"
#include "metaball/photo/photo_choice.h"
#include "metaball/vec.h"

namespace sherd::kernels {

inline constexpr int kTileBits = 6;
inline constexpr int kTileSide = 1 << kTileBits;  // pixels
inline constexpr int kTilePixels = kTileSide * kTileSide;

// The tiles of all photographs are numbered through: photograph by photograph, level by level from
// the finest, row by row.
struct TiledLevel {
  int width, height;  // pixels
  std::uint32_t first_tile;
  std::uint32_t columns;  // tiles in a row

  SHERD_HD std::uint32_t TileAt(int x, int y) const {
    return first_tile + static_cast<std::uint32_t>(y >> kTileBits) * columns +
           static_cast<std::uint32_t>(x >> kTileBits);
  }
};

struct TiledPhoto {
  static constexpr int kMostLevels = 31;
  int finest, coarsest;  // the levels that can be read; none where finest > coarsest
  TiledLevel level[kMostLevels];
};

// What is known of a tile. Threads that look at one at the same time write the same.
struct TileState {
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};  // not in the pool
  static constexpr std::uint32_t kWanted = kNone - 1;        // nor there, but asked for

  std::uint32_t slot;
  std::uint32_t used;  // the round it was looked at last
};

// Where the pool's tiles lie: chunk by chunk.
inline constexpr int kChunkBits = 11;  // 2048 tiles, 24 MiB
struct TilePool {
  Rgb8* const* chunk;

  SHERD_HD Rgb8* Tile(std::uint32_t slot) const {
    return chunk[slot >> kChunkBits] +
           static_cast<std::size_t>(slot & ((1u << kChunkBits) - 1)) * kTilePixels;
  }
};

struct PhotoTilesView {
  const TiledPhoto* photo;
  TileState* state;  // of each tile
  TilePool pool;
  const float* linear;  // of each encoded byte
  std::uint32_t round;
};

// The texels of filter.h. A tile that is not there is asked for, and its pixels are black.
struct TileTexels {
  struct Level {
    int width, height;
    const TiledLevel& level;
    const PhotoTilesView& tiles;
    bool* missing;

    SHERD_HD Vec3f operator()(int x, int y) const {
      TileState& state = tiles.state[level.TileAt(x, y)];
      const std::uint32_t slot = LoadRelaxed(&state.slot);
      if (slot >= TileState::kWanted) {
        if (slot == TileState::kNone) StoreRelaxed(&state.slot, TileState::kWanted);
        *missing = true;
        return {};
      }
      if (LoadRelaxed(&state.used) != tiles.round) StoreRelaxed(&state.used, tiles.round);
      const Rgb8* const tile = tiles.pool.Tile(slot);
      const Rgb8 c = tile[(y & (kTileSide - 1)) << kTileBits | (x & (kTileSide - 1))];
      return {tiles.linear[c.r], tiles.linear[c.g], tiles.linear[c.b]};
    }
  };

  const TiledPhoto& photo;
  const PhotoTilesView& tiles;
  bool* missing;

  SHERD_HD int finest() const { return photo.finest; }
  SHERD_HD int coarsest() const { return photo.coarsest; }
  SHERD_HD Level At(int at) const {
    const TiledLevel& l = photo.level[at];
    return {l.width, l.height, l, tiles, missing};
  }
};

// One thread a lookup; kMostPhotos of a pixel lie together.
struct SamplePhotos {
  static constexpr int kThreads = 128;
  static constexpr int kBlocksPerMultiprocessor = 8;  // 64 registers

  PhotoTilesView tiles;
  const PhotoLookup* lookups;
  const std::uint8_t* count;  // of a pixel's lookups; kMostPhotos at most, or nothing to look up
  const Vec3f* gain;          // by photograph; null: 1
  std::uint64_t first;        // lookup
  PhotoColors* colors;
  std::uint8_t* there;         // false where the photograph cannot be read
  std::uint32_t* looked_into;  // by photograph
  std::uint32_t* missing;      // lookups of which a tile is

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::uint64_t i = first + thread;
    if (i % kMostPhotos >= (count[i / kMostPhotos] & kCountMask)) return;
    const PhotoLookup lookup = lookups[i];
    const TiledPhoto& photo = tiles.photo[lookup.photo];
    there[i] = photo.finest <= photo.coarsest;
    if (!there[i]) return;
    bool misses = false;
    const PhotoColors c = SampleColors(TileTexels{photo, tiles, &misses}, lookup);
    if (misses) {
      AtomicAdd(missing, 1);
      return;
    }
    if (LoadRelaxed(&looked_into[lookup.photo]) == 0) StoreRelaxed(&looked_into[lookup.photo], 1);
    colors[i] = gain ? WithGain(c, gain[lookup.photo]) : c;
  }

  // The rest of a pixel's count says what it is (photo_colors.h).
  static constexpr std::uint8_t kCountMask = 7;
};

// One thread a tile: lists those that are asked for, as far as there is room, and asks for none any
// more.
struct CollectWanted {
  TileState* state;
  std::uint32_t* wanted;
  std::uint32_t room;
  std::uint32_t* count;  // of all

  SHERD_HD void operator()(std::uint64_t tile) const {
    if (state[tile].slot != TileState::kWanted) return;
    state[tile].slot = TileState::kNone;
    const std::uint32_t at = AtomicFetchAdd(count, 1);
    if (at < room) wanted[at] = static_cast<std::uint32_t>(tile);
  }
};

// One thread a tile of the list: when it was looked at last.
struct GatherUses {
  const TileState* state;
  const std::uint32_t* tile;
  std::uint32_t* used;

  SHERD_HD void operator()(std::uint64_t i) const { used[i] = state[tile[i]].used; }
};

// One thread a tile of the list: it leaves the pool.
struct DropTiles {
  const std::uint32_t* tile;
  TileState* state;

  SHERD_HD void operator()(std::uint64_t i) const { state[tile[i]].slot = TileState::kNone; }
};

// One thread a pixel of tiles that lie one after another: copies them into their slots.
struct PlaceTiles {
  const Rgb8* staged;
  const std::uint32_t* tile;
  const std::uint32_t* slot;
  TilePool pool;
  TileState* state;
  std::uint32_t round;

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::uint64_t i = thread / kTilePixels, pixel = thread % kTilePixels;
    pool.Tile(slot[i])[pixel] = staged[thread];
    if (pixel == 0) state[tile[i]] = {slot[i], round};
  }
};

}  // namespace sherd::kernels
