// A saved project: what was imported, the density levels built from it, the views and settings.
//
// On disk: NAME.sherd (JSON, versioned, paths relative to it) and beside it NAME.sherd.d/ with
// survey.bin (the imported survey) and one folder a level. The input is never changed.
//
// A stage writes its files under names that are free and then replaces the JSON in one step; what
// the old JSON named is removed after that. So a stage that fails, is cancelled or loses its power
// leaves the project as it was. Two programs never work on one project at once: the second is told
// so.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/project/view.h"
#include "metaball/control.h"
#include "reconstruction/ground_plane.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"
#include "reconstruction/workspace.h"

namespace sherd {

// Two points of the survey whose distance was measured on the site.
struct KnownDistance {
  Vec3d first{}, second{};  // world units, in the project's frame
  double metres = 0;
};
// Metres per unit; InputError where the points coincide or the length is not positive.
double ScaleOf(const KnownDistance& distance);

struct ImportOptions {
  std::string source;        // a workspace at any level, a point cloud file, a mesh
  std::string photo_folder;  // may be empty
  std::string mask_folder;   // of masks (photo_mask.h); may be empty
  std::optional<std::size_t> model;
  PointSource points = PointSource::kAuto;
  // A transform of colmap model_aligner (similarity.h) that is applied to everything; the project
  // is in its target frame. May be empty.
  std::string transform;
  std::optional<double> metres_per_unit;
  std::optional<KnownDistance> known_distance;  // instead of metres_per_unit
  std::optional<Vec3d> up;                      // world; default: estimated from the photographs
  std::optional<std::uint64_t> mesh_samples;    // LoadOptions::mesh_samples
  std::uint64_t decimate_to = 0;
  std::uint64_t memory_limit_bytes = 0;
};

// What an import found; kept in the project for the summary and the report.
struct ImportSummary {
  std::string source;        // absolute where it can be told, as found from the project file
  std::string photo_folder;  // likewise; may be empty
  std::uint64_t cameras = 0, photographs = 0, photographs_found = 0, points = 0;
  bool dense = false, has_normals = false, has_visibility = false;
  std::vector<std::string> warnings;
  double seconds = 0;
};

struct LevelEntry {
  std::string name;    // "63k"
  std::string folder;  // relative to the project file
  LevelStats stats;
  LevelOptions options;  // what it was built with
  std::string program;   // and by which version
};
// What became of the noise of the points that a level was made from: "smoothed" or "kept".
std::string NoiseName(const LevelEntry& level);

class Project;

struct LevelledGround {
  GroundPlane ground;      // in the frame it was found in
  double tilt_rad = 0;     // of its normal against what was up before (+z where nothing was)
  Similarity3d transform;  // from that frame into the project's new one; its scale is 1
};

class Project {
 public:
  // Reads the JSON alone. Throws InputError with the line for anything that is not a project of a
  // version this program knows.
  static Project Open(const std::string& path);
  // True when the file looks like a project (its first bytes; it may still be damaged).
  static bool IsProjectFile(const std::string& path);

  const std::string& path() const { return path_; }
  std::string title() const;  // the file's name without its extension
  const ImportSummary& import_summary() const { return import_; }
  const std::vector<LevelEntry>& levels() const { return levels_; }
  const std::optional<double>& metres_per_unit() const { return metres_per_unit_; }
  const std::optional<Vec3d>& up() const { return up_; }
  // The direction in which the front view looks (preset_axes.h); world.
  const std::optional<Vec3d>& front() const { return front_; }
  // From the frame of what was imported to the project's: a transform given at import, then the
  // turns that levelled the ground. nullopt: not known (a project from before it was kept).
  const std::optional<Similarity3d>& project_from_source() const { return project_from_source_; }
  // What to look at (robust bounds of the points, world).
  const Box3d& bounds() const { return bounds_; }
  // What the view presets fit and are aligned to, the same for all levels. `survey` may be null; it
  // must outlive the result. Throws InputError when a file of the project is missing or damaged.
  ViewContext MakeViewContext(const Survey* survey = nullptr) const;

  // Says what is up, world; any length above 0. `survey` has the photographs that tell the front.
  void SetUp(const Vec3d& up, const Survey& survey);
  void SetMetresPerUnit(std::optional<double> metres_per_unit) {
    metres_per_unit_ = metres_per_unit;
  }
  // Where photographs are looked for first from now on.
  void SetPhotoFolder(const std::string& folder) { import_.photo_folder = folder; }
  // Writes the JSON atomically. Throws OutputError; also when another program has changed the
  // project since this one opened it, or is working on it.
  void Save();

  // The entry called `name`; InputError naming the levels there are.
  const LevelEntry& FindLevel(const std::string& name) const;
  // The level with the most metaballs; InputError when none was built yet.
  const LevelEntry& LargestLevel() const;
  // The survey as it was imported, whether or not its source is still there. Photographs that moved
  // are found again by relative name: in the photo folder, in the source, in images/ beside the
  // project.
  std::shared_ptr<Survey> LoadSurveyFromCache(const Control& control = {}) const;
  std::shared_ptr<const Level> LoadLevel(const std::string& name,
                                         const Control& control = {}) const;

 private:
  friend Project ImportSurvey(const ImportOptions&, const std::string&, const Control&);
  friend void BuildLevels(Project*, const std::vector<std::uint64_t>&, const LevelOptions&,
                          const Control&);
  friend LevelledGround LevelGround(Project*, const GroundOptions&, const Control&);
  friend struct ProjectJson;
  // Throws OutputError when the file on disk is not the one this object was read from.
  void CheckUnchanged() const;
  // Save for one who holds the lock already.
  void SaveLocked();
  std::string Folder() const;  // where the project file lies, absolute
  // Absolute path of something the JSON names.
  std::string Resolve(const std::string& relative) const;
  // Removes what this state of the project names (RemoveOld), once another state stands.
  void RemoveFiles(const std::string& data_folder) const;

  std::string path_;
  std::string survey_file_, outline_file_;  // relative to the project file
  std::uint64_t revision_ = 0;              // counts the saves
  ImportSummary import_;
  std::vector<LevelEntry> levels_;
  std::optional<double> metres_per_unit_;
  std::optional<Vec3d> up_, front_;
  std::optional<Similarity3d> project_from_source_;
  Box3d bounds_;
};

// Loads the workspace and writes the project at `project_path`. An existing project there is
// replaced only when everything succeeded. Throws InputError, OutputError, ResourceError,
// Cancelled.
Project ImportSurvey(const ImportOptions& options, const std::string& project_path,
                     const Control& control = {});

// How a model of a workspace is called on the command line ("--model N") and in a list: the number
// of its folder (sparse/1: 1) where that is a number no other model has, else the next free one.
std::vector<std::size_t> ModelNumbers(const Workspace& workspace);

// Builds one level for each target and adds it to the project (replacing one of the same name),
// then saves. `options.target_count` is ignored. Levels already finished stay when a later one
// fails. Throws as ImportSurvey.
void BuildLevels(Project* project, const std::vector<std::uint64_t>& targets,
                 const LevelOptions& options, const Control& control = {});

// Finds the ground (ground_plane.h), turns the whole project so that it is level at z = 0 and +z is
// up, and saves: survey, photographs, levels, bounds and front. `options.up` defaults to the
// project's. Throws InputError where there is no ground, else as ImportSurvey; then nothing has
// changed.
LevelledGround LevelGround(Project* project, const GroundOptions& options,
                           const Control& control = {});

}  // namespace sherd
