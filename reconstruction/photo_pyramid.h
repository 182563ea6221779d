// Photographs decoded into MIP levels. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <string>

#include "metaball/photo/pyramid.h"

namespace sherd {

// Decodes the file, keeping levels `finest` and coarser: no finer one is ever held whole. The last
// column and row of an odd size are averaged with fewer pixels; averages in linear light. Throws
// InputError naming the file.
PhotoPyramid ReadPhotoPyramid(const std::string& path, int finest);

// The encoded byte of a linear value in [0, 1], exact to a quarter of a step.
std::uint8_t EncodeLinear(float v);

}  // namespace sherd
