// The surface points of a finished frame in groups of neighbours, for passes that cast rays from
// them.
#pragma once

#include <functional>
#include <vector>

#include "metaball/appearance/occlusion_rays.h"
#include "metaball/camera.h"
#include "metaball/control.h"
#include "metaball/frame.h"
#include "metaball/scene.h"

namespace sherd {

// Calls visit(group, worker) for groups of 1 to 64 hits that lie together both in the picture and
// in space; every hit is in one group. The groups do not depend on the number of threads; the order
// of the calls does. frame: with depth and id planes.
void ForEachHitGroup(const Scene& scene, const Camera& camera, const Frame& frame, int threads,
                     const Control& control,
                     const std::function<void(const std::vector<HitPoint>&, int worker)>& visit);

}  // namespace sherd
