// Whether two levels and surfaces are the same. Internal to reconstruction/.
#pragma once

#include <cstdint>

#include "metaball/scene.h"
#include "reconstruction/level.h"

namespace sherd {

// Equal for an equal surface of equal metaballs with equal normals, depths and lists.
std::uint64_t DigestOf(const Level& level, const Surface& surface);

}  // namespace sherd
