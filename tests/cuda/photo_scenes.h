// Photographs and lookups on which samplers are compared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "metaball/photo/lookup.h"
#include "metaball/photo/pyramid.h"

namespace sherd {

// Noise that differs from pixel to pixel and level to level, so that a pixel taken from the wrong
// place shows. Holds the levels from `finest` on; what it holds does not depend on `finest`.
PhotoPyramid MakeNoisePhoto(int width, int height, int finest, std::uint32_t seed);

// Lookups of one photograph row by row: all over it and a little beyond its border, footprints from
// a quarter of a pixel to a hundred, up to thirty times as long as wide. Deterministic.
std::vector<PhotoLookup> MakeLookups(std::uint32_t photo, int width, int height, std::size_t count);

}  // namespace sherd
