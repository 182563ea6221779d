// How texture coordinates change across space, for each metaball: what lets a texture be looked up
// at the surface point itself with more detail than there are metaballs.
//
// Blending coordinates alone, sum (f_i / F) uv_i, gives steps: near a centre one metaball decides
// almost alone. Each metaball therefore contributes the coordinates it foresees at the point,
// uv_i + grad uv_i . (p - c_i), and the blend reproduces every linear map exactly, for any weights.
#pragma once

#include <string>

#include "metaball/cloud.h"
#include "metaball/control.h"

namespace sherd {

// "uv" -> "uv.du" (axis 0) and "uv.dv" (axis 1).
std::string UvGradientName(const std::string& uv_channel, int axis);

// Adds the two channels to the cloud, or computes them anew: least squares over the nearest
// metaballs, per world unit. periodic: both coordinates wrap at 1. Neighbours in another chart of
// the texture, whose coordinates lie much farther away than those of the rest, are left out. A
// metaball without neighbours gets zero. Throws Error for a channel that does not exist or has not
// two components; Cancelled.
void AddUvGradients(Cloud* cloud, const std::string& uv_channel, bool periodic = false,
                    int threads = 0, const Control& control = {});

// Adds a channel of one component, or computes it anew: the mean distance to the six nearest
// metaballs, world units; 0 where there is only one metaball.
void AddSpacingChannel(Cloud* cloud, const std::string& name = "spacing", int threads = 0,
                       const Control& control = {});

}  // namespace sherd
