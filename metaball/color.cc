#include "metaball/color.h"

#include <array>

namespace sherd {

const float* SrgbToLinearTable() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t{};
    for (int i = 0; i < 256; ++i) t[i] = LinearFromSrgb(static_cast<float>(i) / 255.0f);
    return t;
  }();
  return table.data();
}

}  // namespace sherd
