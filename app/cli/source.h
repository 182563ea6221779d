// What is rendered or exported: a level of a project, a metaball file, the thesis's file, a mesh or
// a point cloud.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/project/project.h"
#include "app/project/view.h"
#include "metaball/cloud.h"
#include "metaball/control.h"
#include "metaball/scene.h"

namespace sherd::cli {

enum class SourceKind { kProject, kMetaballFile, kThesisFile, kPly, kMesh };

// Looks at the file's first bytes, and at its name where a format has no mark of its own. Throws
// InputError naming what can be given.
SourceKind KindOf(const std::string& path);

struct Source {
  SourceKind kind = SourceKind::kProject;
  std::string path;
  std::optional<Project> project;
  std::shared_ptr<const Level> level;    // of a project
  std::shared_ptr<const Survey> survey;  // of a project, where it was asked for
  std::shared_ptr<const Cloud> cloud;
  Surface surface;      // as the file or the level has it
  std::string texture;  // the image that channel "uv" of the cloud belongs to; may be empty
  std::string normal_map_texture;
  ViewContext view;  // refers to `survey`
  std::vector<std::string> warnings;
  std::uint64_t dropped = 0;  // metaballs of a .ply or a mesh that cannot be drawn
};

struct SourceOptions {
  std::string level;                    // of a project; empty: the largest
  bool survey = false;                  // load cameras and photographs too
  std::string photo_folder;             // where the photographs are now
  std::optional<double> radius_factor;  // of a .ply without radii, or a mesh
  std::uint64_t samples = 0;            // points on a mesh's triangles; 0: its vertices
  bool channels = false;                // normals too, where the source has them beside the cloud
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
