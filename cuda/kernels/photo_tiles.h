// Photographs as tiles in a pool: their layout, and the kernels that find out which tiles lookups
// read, put tiles into the pool and look colours up.
#pragma once

#include <cstdint>

#include "cuda/kernels/device_ops.h"
#include "metaball/color.h"
#include "metaball/hostdevice.h"
#include "metaball/photo/filter.h"
#include "metaball/photo/pyramid.h"

namespace sherd::kernels {

inline constexpr int kTileBits = 6;
inline constexpr int kTileSide = 1 << kTileBits;  // pixels
inline constexpr int kTilePixels = kTileSide * kTileSide;

// A photograph's tiles are numbered row by row, level by level from the finest.
struct TiledLevel {
  int width, height;         // pixels
  std::uint32_t first_tile;  // of the photograph's
  std::uint32_t columns;     // tiles in a row

  SHERD_HD std::uint32_t TileAt(int x, int y) const {
    return first_tile + static_cast<std::uint32_t>(y >> kTileBits) * columns +
           static_cast<std::uint32_t>(x >> kTileBits);
  }
};

struct TiledPhoto {
  static constexpr int kMostLevels = 31;
  int finest, coarsest;  // the levels that are read
  TiledLevel level[kMostLevels];
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

// Notes for every tile that is read the first lookup that reads it.
struct MarkTiles {
  TiledPhoto photo;
  const PhotoLookup* lookups;
  std::uint32_t begin;        // the first lookup
  std::uint32_t* first_need;  // of each tile

  struct LevelTexels {
    int width, height;
    const TiledLevel& level;
    std::uint32_t* first_need;
    std::uint32_t lookup;
    SHERD_HD Vec3f operator()(int x, int y) const {
      AtomicMin(&first_need[level.TileAt(x, y)], lookup);
      return {};
    }
  };
  struct Texels {
    const TiledPhoto& photo;
    std::uint32_t* first_need;
    std::uint32_t lookup;
    SHERD_HD int finest() const { return photo.finest; }
    SHERD_HD int coarsest() const { return photo.coarsest; }
    SHERD_HD LevelTexels At(int level) const {
      const TiledLevel& l = photo.level[level];
      return {l.width, l.height, l, first_need, lookup};
    }
  };

  SHERD_HD void operator()(std::uint64_t thread) const {
    const auto i = static_cast<std::uint32_t>(begin + thread);
    SampleColors(Texels{photo, first_need, i}, lookups[i]);
  }
};

// Copies tiles that lie one after another into their slots.
struct PlaceTiles {
  const Rgb8* staged;
  const std::uint32_t* slots;
  TilePool pool;

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::uint32_t slot = slots[thread / kTilePixels];
    pool.Tile(slot)[thread % kTilePixels] = staged[thread];
  }
};

// The colours of lookups whose tiles are all in the pool.
struct SamplePhoto {
  TiledPhoto photo;
  const PhotoLookup* lookups;
  std::uint32_t begin;           // the first lookup
  const std::uint32_t* slot_of;  // of each tile that is read
  TilePool pool;
  const float* linear;  // of each encoded byte
  PhotoColors* colors;  // of each lookup

  struct LevelTexels {
    int width, height;
    const TiledLevel& level;
    const SamplePhoto& own;
    SHERD_HD Vec3f operator()(int x, int y) const {
      const Rgb8* const tile = own.pool.Tile(own.slot_of[level.TileAt(x, y)]);
      const Rgb8 c = tile[(y & (kTileSide - 1)) << kTileBits | (x & (kTileSide - 1))];
      return {own.linear[c.r], own.linear[c.g], own.linear[c.b]};
    }
  };
  SHERD_HD int finest() const { return photo.finest; }
  SHERD_HD int coarsest() const { return photo.coarsest; }
  SHERD_HD LevelTexels At(int level) const {
    const TiledLevel& l = photo.level[level];
    return {l.width, l.height, l, *this};
  }

  SHERD_HD void operator()(std::uint64_t thread) const {
    const auto i = static_cast<std::uint32_t>(begin + thread);
    colors[i] = SampleColors(*this, lookups[i]);
  }
};

}  // namespace sherd::kernels
