// Levelling a project by its ground.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "app/project/project.h"
#include "app/project/project_files.h"
#include "app/project/project_lock.h"
#include "app/project/survey_file.h"
#include "metaball/progress_range.h"

namespace sherd {

namespace fs = std::filesystem;

LevelledGround LevelGround(Project* project, const GroundOptions& options, const Control& control) {
  const fs::path data_folder = fs::path(project->Resolve(project->survey_file_)).parent_path();
  const ProjectLock lock(project->path_, data_folder.string());
  project->CheckUnchanged();
  // As it is on disk: the paths of photographs that are not there just now are kept.
  Survey survey = ReadSurveyFile(project->Resolve(project->survey_file_), PartOf(control, 0, 0.1));

  LevelledGround result;
  GroundOptions search = options;
  if (!search.up) search.up = project->up_;
  result.ground = FindGround(survey.points, search, project->path_, PartOf(control, 0.1, 0.2));
  const Vec3d up_before = Normalized(search.up.value_or(Vec3d{0, 0, 1}));
  result.tilt_rad = std::acos(std::clamp(Dot(up_before, result.ground.normal), -1.0, 1.0));
  result.transform = LevelWith(result.ground);
  const Rigid3d& motion = result.transform.rotation_and_translation;
  TransformSurvey(result.transform, &survey);

  Project moved = *project;
  moved.up_ = Vec3d{0, 0, 1};
  if (moved.project_from_source_) {
    moved.project_from_source_ = Compose(result.transform, *moved.project_from_source_);
  }
  if (moved.front_) {
    const Vec3d front = motion.Rotate(*moved.front_);
    moved.front_ = Normalized(Vec3d{front.x, front.y, 0}, Vec3d{0, 1, 0});
  }
  moved.bounds_ = RobustBounds(survey.points.position);
  const fs::path project_folder = project->Folder();
  const auto relative = [&](const fs::path& path) {
    return path.lexically_relative(project_folder).string();
  };
  Scratch survey_file(FreeName(data_folder, "survey", ".bin"));
  moved.survey_file_ = relative(survey_file.path());
  WriteSurveyFile(survey_file.path().string(), survey, PartOf(control, 0.2, 0.3));
  Scratch outline_file(FreeName(data_folder, "outline", ".bin"));
  moved.outline_file_ = relative(outline_file.path());
  WriteOutlineFile(outline_file.path().string(),
                   SamplePoints(survey.points.position, moved.bounds_));
  std::vector<Scratch> folders;
  for (LevelEntry& entry : moved.levels_) {
    const double share = 0.7 / static_cast<double>(moved.levels_.size());
    const double from = 0.3 + share * static_cast<double>(folders.size());
    const std::string name = entry.name + ": ";
    control.Report(name + "levelling", from);
    Level level = *project->LoadLevel(entry.name, PartOf(control, from, from + 0.5 * share, name));
    TransformLevel(motion, &level);
    folders.push_back(WriteLevel(data_folder, level, control));
    entry.folder = relative(folders.back().path());
  }
  moved.SaveLocked();
  survey_file.Keep();
  outline_file.Keep();
  for (Scratch& folder : folders) folder.Keep();

  project->RemoveFiles(data_folder.string());
  *project = std::move(moved);
  control.Report("levelled", 1);
  return result;
}

}  // namespace sherd
