// Whether two levels are the same. Internal to reconstruction/.
#pragma once

#include <cstdint>

#include "reconstruction/level.h"

namespace sherd {

// Equal for equal metaballs with equal normals, depths and lists.
std::uint64_t DigestOf(const Level& level);

}  // namespace sherd
