// A saved project: what was imported, the density levels built from it, the views and settings.
//
// On disk: NAME.sherd (JSON, versioned, paths relative to it, written atomically) and beside it
// NAME.sherd.d/ with survey.bin (the imported survey) and one folder a level. The input is never
// changed. A stage that fails or is cancelled leaves the project as it was.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"
#include "reconstruction/workspace.h"

namespace sherd {

struct ImportOptions {
  std::string source;        // a workspace at any level, or a point cloud file
  std::string photo_folder;  // may be empty
  std::optional<std::size_t> model;
  PointSource points = PointSource::kAuto;
  std::optional<double> metres_per_unit;
  std::uint64_t decimate_to = 0;
  std::uint64_t memory_limit_bytes = 0;
};

// What an import found; kept in the project for the summary and the report.
struct ImportSummary {
  std::string source;
  std::uint64_t cameras = 0, photographs = 0, photographs_found = 0, points = 0;
  bool dense = false, has_normals = false, has_visibility = false;
  std::vector<std::string> warnings;
  double seconds = 0;
};

struct LevelEntry {
  std::string name;    // "63k"
  std::string folder;  // relative to the project file
  LevelStats stats;
};

class Project {
 public:
  // Reads the JSON alone. Throws InputError with the line for anything that is not a project of a
  // version this program knows.
  static Project Open(const std::string& path);

  const std::string& path() const { return path_; }
  const ImportSummary& import_summary() const { return import_; }
  const std::vector<LevelEntry>& levels() const { return levels_; }
  const std::optional<double>& metres_per_unit() const { return metres_per_unit_; }
  const std::optional<Vec3d>& up() const { return up_; }
  // What to look at (robust bounds of the points, world).
  const Box3d& bounds() const { return bounds_; }

  void SetMetresPerUnit(std::optional<double> metres_per_unit) {
    metres_per_unit_ = metres_per_unit;
  }
  // Writes the JSON atomically. Throws OutputError.
  void Save() const;

  // The entry called `name`; InputError naming the levels there are.
  const LevelEntry& FindLevel(const std::string& name) const;
  std::shared_ptr<const Survey> LoadSurveyFromCache(const Control& control = {}) const;
  std::shared_ptr<const Level> LoadLevel(const std::string& name,
                                         const Control& control = {}) const;

 private:
  friend Project ImportSurvey(const ImportOptions&, const std::string&, const Control&);
  friend void BuildLevels(Project*, const std::vector<std::uint64_t>&, const LevelOptions&,
                          const Control&);
  std::string path_;
  ImportSummary import_;
  std::vector<LevelEntry> levels_;
  std::optional<double> metres_per_unit_;
  std::optional<Vec3d> up_;
  Box3d bounds_;
};

// Loads the workspace and writes the project at `project_path`. An existing project there is
// replaced only when everything succeeded. Throws InputError, OutputError, ResourceError,
// Cancelled.
Project ImportSurvey(const ImportOptions& options, const std::string& project_path,
                     const Control& control = {});

// Builds one level for each target and adds it to the project (replacing one of the same name),
// then saves. `options.target_count` is ignored. Levels already finished stay when a later one
// fails.
void BuildLevels(Project* project, const std::vector<std::uint64_t>& targets,
                 const LevelOptions& options, const Control& control = {});

}  // namespace sherd
