// What is open: a project with its levels, or a bare cloud as a single level.
//
// Loading is slow and happens off the interface thread; a Document is immutable but for its caches,
// and thread-safe.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "app/project/project.h"
#include "metaball/control.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"

namespace sherd {

class Document {
 public:
  // A .sherd project. Throws as Project::Open.
  static std::shared_ptr<Document> OpenProject(const std::string& path);
  static std::shared_ptr<Document> FromProject(Project project);
  // A metaball file, or a PLY with any of x y z radius red green blue. Throws InputError,
  // ResourceError, Cancelled.
  static std::shared_ptr<Document> OpenCloud(const std::string& path, const Control& control);

  const std::string& path() const { return path_; }
  // The file's name without folder and extension.
  const std::string& title() const { return title_; }
  const std::vector<LevelEntry>& levels() const { return levels_; }
  const Box3d& bounds() const { return bounds_; }
  const std::optional<Vec3d>& up() const { return up_; }
  const std::optional<Vec3d>& front() const { return front_; }
  const std::optional<double>& metres_per_unit() const { return metres_per_unit_; }
  // Null for a bare cloud.
  const Project* project() const { return project_ ? &*project_ : nullptr; }
  bool HasPhotographs() const;

  // Levels and the survey are kept as long as somebody holds them. May take seconds. Throw as
  // Project's functions of the same name.
  std::shared_ptr<const Level> LoadLevel(std::size_t level_idx, const Control& control);
  std::shared_ptr<const Survey> LoadSurvey(const Control& control);

  // The same document with another scale; nothing is written before SaveProject.
  std::shared_ptr<Document> WithScale(std::optional<double> metres_per_unit) const;
  // As Project::Save; nothing for a bare cloud. Call before the document is shared.
  void SaveProject();

 private:
  Document() = default;

  std::string path_, title_;
  std::optional<Project> project_;
  std::vector<LevelEntry> levels_;
  Box3d bounds_;
  std::optional<Vec3d> up_, front_;
  std::optional<double> metres_per_unit_;
  std::shared_ptr<const Level> own_level_;  // a bare cloud's

  struct LevelCache {
    std::mutex loading;
    std::weak_ptr<const Level> level;
  };
  std::vector<std::unique_ptr<LevelCache>> caches_;
  mutable std::mutex survey_loading_;
  std::weak_ptr<const Survey> survey_;
};

// What a path is, decided by looking at it.
enum class PathKind { kProject, kCloud, kWorkspace };
// Throws InputError for a path that does not exist. A .ply is a cloud when it has radii; without
// them it is a survey to make levels from. Everything unknown is left to InspectWorkspace.
PathKind ClassifyPath(const std::string& path);

// Level sizes to propose for a survey of `points` points: 63k, 126k, 252k, 502k as far as there
// are points; for smaller surveys all points and halves of them.
std::vector<std::uint64_t> SuggestLevels(std::uint64_t points);

}  // namespace sherd
