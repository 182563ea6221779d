// Points of a dense workspace. Internal to reconstruction/.
#pragma once

#include "metaball/control.h"
#include "reconstruction/workspace.h"

namespace sherd {

// A cloud with the photographs of its model (options.model, else the cloud's own) and what its .vis
// file says. Photographs are not located yet. Throws InputError, ResourceError, Cancelled.
Survey LoadDense(const Workspace& workspace, const DenseCloudFile& cloud,
                 const LoadOptions& options, const Control& control);

// The points of the depth maps; photographs are located before, for their colours. Throws
// InputError, ResourceError, Cancelled.
Survey LoadDepthMaps(const Workspace& workspace, const DepthMapSet& maps,
                     const LoadOptions& options, const Control& control);

}  // namespace sherd
