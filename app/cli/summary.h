// Projects in words and in JSON, as info, import and build print them.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "app/cli/command.h"
#include "app/project/project.h"

namespace sherd::cli {

Json ToJson(const LevelEntry& level);
Json ToJson(const Project& project);
// Scale, quaternion w x y z, translation, as in colmap model_aligner's file.
Json ToJson(const Similarity3d& similarity);

// What was imported, and what to do next where something is missing.
std::string DescribeImport(const Project& project);
// The levels as a table; empty where there are none.
std::string DescribeLevels(const Project& project);

}  // namespace sherd::cli
