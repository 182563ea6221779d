// The photographs' files for a loaded survey. Internal to reconstruction/.
#pragma once

#include <string>

#include "metaball/control.h"
#include "reconstruction/workspace.h"

namespace sherd {

// Sets path, and for an undistorted model original_path and original_camera_idx, of the survey's
// photographs, and warns about those not found or of the wrong size. dense_root: the dense
// workspace the survey's model belongs to, or empty.
void LocatePhotographs(const Workspace& workspace, const std::string& photo_folder,
                       const std::string& dense_root, const Control& control, Survey* survey);

}  // namespace sherd
