// What a workspace lacks, for people. Internal to reconstruction/.
#pragma once

#include <string>
#include <vector>

#include "reconstruction/workspace.h"

namespace sherd {

std::vector<std::string> WhatIsMissing(const Workspace& workspace);

}  // namespace sherd
