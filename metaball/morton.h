// Morton keys: the bits of three integers interleaved, x lowest (thesis, section 2.4.2).
#pragma once

#include <cstdint>

#include "metaball/hostdevice.h"

namespace sherd {

// Spreads the low 21 bits of v so that two zero bits follow each.
SHERD_HD constexpr std::uint64_t SpreadBits21(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x001f00000000ffffull;
  v = (v | v << 16) & 0x001f0000ff0000ffull;
  v = (v | v << 8) & 0x100f00f00f00f00full;
  v = (v | v << 4) & 0x10c30c30c30c30c3ull;
  v = (v | v << 2) & 0x1249249249249249ull;
  return v;
}

// 63-bit key of three 21-bit coordinates; each group of three bits is z y x.
SHERD_HD constexpr std::uint64_t MortonKey63(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return SpreadBits21(x) | SpreadBits21(y) << 1 | SpreadBits21(z) << 2;
}

}  // namespace sherd
