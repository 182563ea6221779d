// Positions of set bits, on the CPU and on the GPU, which has no <bit>.
#pragma once

#include <bit>
#include <cstdint>

#include "metaball/hostdevice.h"

namespace sherd {

// Position of the lowest set bit, 0 to 31; bits != 0.
SHERD_HD int LowestBit(std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __ffs(static_cast<int>(bits)) - 1;
#else
  return std::countr_zero(bits);
#endif
}

// The same of 64, 0 to 63.
SHERD_HD int LowestBit(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return __ffsll(static_cast<long long>(bits)) - 1;
#else
  return std::countr_zero(bits);
#endif
}

// Position of the highest set bit, 0 to 31; bits != 0.
SHERD_HD int HighestBit(std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return 31 - __clz(static_cast<int>(bits));
#else
  return 31 - std::countl_zero(bits);
#endif
}

}  // namespace sherd
