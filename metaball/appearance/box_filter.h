// The thesis's low-pass filter on a finished picture (thesis 4.3): the mean of a square of pixels.
#pragma once

#include <vector>

#include "metaball/frame.h"

namespace sherd {

// size: 1 (nothing is done) or 3, 5, 7, 9, 11. Each pixel becomes the mean of the size x size
// pixels around it that lie in the picture, in linear light; alpha is premultiplied, so the
// background takes part as what it is, nothing, and no dark rim appears. Running sums: the cost
// does not depend on the size. Throws Error for another size.
void BoxFilter(int width, int height, int size, std::vector<Pixel>* color, int threads = 0);

// Throws Error for a size that is none of the above.
void CheckFilterSize(int size);

}  // namespace sherd
