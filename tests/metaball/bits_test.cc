#include "metaball/bits.h"

#include <gtest/gtest.h>

namespace sherd {
namespace {

TEST(Bits, EndsOfEveryWidth) {
  for (int k = 0; k < 32; ++k) {
    const std::uint32_t bit = std::uint32_t{1} << k;
    EXPECT_EQ(LowestBit(bit), k);
    EXPECT_EQ(HighestBit(bit), k);
    EXPECT_EQ(LowestBit(bit | 0x80000000u), k);
    EXPECT_EQ(HighestBit(bit | 1u), k);
  }
}

}  // namespace
}  // namespace sherd
