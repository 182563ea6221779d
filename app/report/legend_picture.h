// A legend drawn: the bar of colours with its ticks, for the corner of a picture.
#pragma once

#include "metaball/appearance/legend.h"
#include "metaball/frame.h"

namespace sherd {

// The legend as a picture of its own, on a panel of white with a little of what lies behind it; its
// size follows the height of the picture it is for (the width of its text too).
Frame DrawLegend(const Legend& legend, int picture_height_px);

// Lays it over the lower left corner of a picture of that height; `strip` holds the picture's rows
// from `first_row` on. Values are linear light, alpha premultiplied.
void OverlayLegend(const Frame& legend, int picture_height_px, int first_row, Frame* strip);

}  // namespace sherd
