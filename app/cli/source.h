// What is rendered: a level of a project, a metaball file or a point cloud in a .ply file.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/project/project.h"
#include "app/project/view.h"
#include "metaball/cloud.h"
#include "metaball/control.h"

namespace sherd::cli {

enum class SourceKind { kProject, kMetaballFile, kPly };

// Looks at the file's first bytes. Throws InputError naming what can be given.
SourceKind KindOf(const std::string& path);

struct Source {
  SourceKind kind = SourceKind::kProject;
  std::string path;
  std::optional<Project> project;
  std::shared_ptr<const Level> level;    // of a project
  std::shared_ptr<const Survey> survey;  // of a project, where it was asked for
  std::shared_ptr<const Cloud> cloud;
  double threshold = 0.7;
  ViewContext view;  // refers to `survey`
  std::vector<std::string> warnings;
  std::uint64_t dropped = 0;  // metaballs of a .ply that cannot be drawn
};

struct SourceOptions {
  std::string level;                    // of a project; empty: the largest
  bool survey = false;                  // load cameras and photographs too
  std::string photo_folder;             // where the photographs are now
  std::optional<double> radius_factor;  // of a .ply without radii
};

// Throws InputError, ResourceError, Cancelled.
Source OpenSource(const std::string& path, const SourceOptions& options, const Control& control);

// The project's survey, its photographs looked for in `photo_folder` too (may be empty).
std::shared_ptr<const Survey> LoadSurveyWithPhotos(const Project& project,
                                                   const std::string& photo_folder,
                                                   const Control& control);

// What is worth looking at in a bare cloud: robust bounds of the centres with a radius around them,
// and some of the centres.
ViewContext ViewOf(const Cloud& cloud);

}  // namespace sherd::cli
