// What the list of a screen tile is made of.
#pragma once

#include <cstdint>

namespace sherd {

struct TileEntry {
  std::uint32_t metaball;  // index into the cloud
  // A lower bound of the distance at which any ray enters the metaball's support, local units.
  float front;
};

}  // namespace sherd
