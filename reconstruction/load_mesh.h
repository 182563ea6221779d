// A mesh becomes the points of a survey. Internal to reconstruction/.
#pragma once

#include "metaball/control.h"
#include "reconstruction/workspace.h"

namespace sherd {

// Points of the mesh `cloud.path` as options.mesh_samples says, with the photographs of its model
// (options.model, else the cloud's own) where there is one; not located yet. Throws InputError,
// ResourceError, Cancelled.
Survey LoadMesh(const Workspace& workspace, const DenseCloudFile& cloud, const LoadOptions& options,
                const Control& control);

}  // namespace sherd
