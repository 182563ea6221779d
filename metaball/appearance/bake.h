// The thesis's own way of texturing (algorithm 5): each metaball takes the colour of the image at
// its own coordinates, and the colours are blended like any others. Detail is limited by the
// number of metaballs (figures 4.7, 4.14); the picture then needs no passes and no image.
#pragma once

#include <vector>

#include "metaball/appearance/appearance.h"
#include "metaball/cloud.h"

namespace sherd {

// The colour of every metaball: the image at its coordinates, or at its centre's projection,
// bilinear in the full image. To be put into Cloud::color. Throws Error for a lookup without image
// or a channel that does not exist.
std::vector<Rgb8> TextureColors(const Cloud& cloud, const TextureLookup& lookup, int threads = 0);

}  // namespace sherd
