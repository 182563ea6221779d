#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <set>

#include "app/project/preset_axes.h"
#include "app/project/project.h"
#include "app/project/project_files.h"
#include "app/project/project_json.h"
#include "app/project/project_lock.h"
#include "app/project/survey_file.h"
#include "metaball/error.h"
#include "metaball/progress_range.h"
#include "metaball/stopwatch.h"
#include "reconstruction/photo_colors.h"
#include "reconstruction/similarity.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

void CheckDestination(const std::string& path) {
  std::error_code error;
  const fs::path folder = fs::absolute(path, error).parent_path();
  if (!fs::is_directory(folder, error)) {
    throw OutputError(path, "the folder " + folder.string() + " does not exist; make it first");
  }
  if (fs::is_directory(path, error)) {
    throw OutputError(path, "is a folder; give the project a file name that ends in .sherd");
  }
  if (fs::exists(path, error) && fs::file_size(path, error) > 0 && !Project::IsProjectFile(path)) {
    throw OutputError(path, "is no Sherd project and will not be replaced; choose another name");
  }
}

}  // namespace

std::vector<std::size_t> ModelNumbers(const Workspace& workspace) {
  const std::size_t n = workspace.models.size();
  constexpr std::size_t kNone = ~std::size_t{0};
  std::vector<std::size_t> numbers(n, kNone);
  std::set<std::size_t> taken;
  for (std::size_t i = 0; i < n; ++i) {
    std::string name = fs::path(workspace.models[i].folder).lexically_normal().filename().string();
    if (name.empty()) {
      name = fs::path(workspace.models[i].folder).parent_path().filename().string();
    }
    std::size_t number = 0;
    const char* end = name.data() + name.size();
    const auto result = std::from_chars(name.data(), end, number);
    if (!name.empty() && result.ec == std::errc() && result.ptr == end && number < 1000000 &&
        taken.insert(number).second) {
      numbers[i] = number;
    }
  }
  std::size_t next = 0;
  for (std::size_t& number : numbers) {
    if (number != kNone) continue;
    while (!taken.insert(next).second) ++next;
    number = next;
  }
  return numbers;
}

double ScaleOf(const KnownDistance& distance) {
  const double units = Length(distance.second - distance.first);
  const double scale = distance.metres / units;
  if (!(distance.metres > 0) || !(units > 0) || !(scale > 0 && scale < INFINITY)) {
    throw InputError("", "",
                     "a known distance needs two different points and a length above 0 metres");
  }
  return scale;
}

Project ImportSurvey(const ImportOptions& options, const std::string& project_path,
                     const Control& control) {
  const Stopwatch watch;
  if (options.metres_per_unit &&
      !(*options.metres_per_unit > 0 && *options.metres_per_unit < INFINITY)) {
    throw InputError("", "", "the scale must be a positive number of metres per unit");
  }
  if (options.up && !(Length(*options.up) > 0 && Length(*options.up) < INFINITY)) {
    throw InputError("", "", "the up direction must have a length above 0");
  }
  const std::optional<double> scale = options.known_distance
                                          ? std::optional(ScaleOf(*options.known_distance))
                                          : options.metres_per_unit;
  std::optional<Similarity3d> transform;
  if (!options.transform.empty()) transform = ReadSimilarity(options.transform);
  CheckDestination(project_path);
  std::error_code error;
  const fs::path project_folder =
      fs::absolute(project_path, error).lexically_normal().parent_path();
  const fs::path data_folder = project_folder / (fs::path(project_path).filename().string() + ".d");
  const ProjectLock lock(project_path, data_folder.string());

  // What is there already is removed after the new project stands.
  Project old;
  if (Project::IsProjectFile(project_path)) {
    try {
      old = Project::Open(project_path);
    } catch (const InputError&) {
      old = {};  // a damaged project is replaced as a whole
    }
  }

  control.Report("looking at the workspace", 0);
  const Workspace workspace = InspectWorkspace(options.source);
  LoadOptions load;
  load.source = options.points;
  load.photo_folder = options.photo_folder;
  load.mask_folder = options.mask_folder;
  load.memory_limit_bytes = options.memory_limit_bytes;
  load.decimate_to = options.decimate_to;
  load.mesh_samples = options.mesh_samples;
  load.model = options.model;
  Survey survey = LoadSurvey(workspace, load, PartOf(control, 0, 0.9));
  control.ThrowIfStopped();
  if (transform) TransformSurvey(*transform, &survey);
  if (scale) survey.metres_per_unit = scale;
  if (options.up) survey.up = Normalized(*options.up);

  Project project;
  project.path_ = project_path;
  project.revision_ = old.revision_;
  project.metres_per_unit_ = survey.metres_per_unit;
  project.up_ = survey.up;
  project.project_from_source_ = transform.value_or(Similarity3d{});
  project.front_ = EstimateFront(survey.photographs, survey.up);
  project.bounds_ = RobustBounds(survey.points.position);
  ImportSummary& summary = project.import_;
  summary.source = fs::absolute(options.source, error).lexically_normal().string();
  if (!options.photo_folder.empty()) {
    summary.photo_folder = fs::absolute(options.photo_folder, error).lexically_normal().string();
  }
  summary.cameras = survey.cameras.size();
  summary.photographs = survey.photographs.size();
  summary.points = survey.points.size();
  summary.dense = survey.dense;
  summary.has_normals = !survey.points.normal.empty();
  summary.has_visibility = !survey.points.photo_begin.empty();
  summary.warnings = survey.warnings;
  for (Photograph& photograph : survey.photographs) {
    if (!photograph.path.empty()) ++summary.photographs_found;
    for (std::string* file : {&photograph.path, &photograph.original_path, &photograph.mask_path}) {
      if (file->empty()) continue;
      const fs::path absolute = fs::absolute(*file, error).lexically_normal();
      *file = absolute.lexically_relative(project_folder).string();
      if (file->empty()) *file = absolute.string();
    }
  }

  control.Report("writing the project", 0.9);
  Scratch survey_file(FreeName(data_folder, "survey", ".bin"));
  project.survey_file_ = survey_file.path().lexically_relative(project_folder).string();
  WriteSurveyFile(survey_file.path().string(), survey, PartOf(control, 0.9, 1));
  Scratch outline_file(FreeName(data_folder, "outline", ".bin"));
  project.outline_file_ = outline_file.path().lexically_relative(project_folder).string();
  WriteOutlineFile(outline_file.path().string(),
                   SamplePoints(survey.points.position, project.bounds_));
  control.ThrowIfStopped();
  summary.seconds = watch.Seconds();
  project.SaveLocked();
  survey_file.Keep();
  outline_file.Keep();

  old.RemoveFiles(data_folder.string());
  control.Report("imported", 1);
  return project;
}

void BuildLevels(Project* project, const std::vector<std::uint64_t>& targets,
                 const LevelOptions& options, const Control& control) {
  if (targets.empty()) throw InputError("", "", "no levels were asked for");
  for (const std::uint64_t target : targets) {
    if (target == 0) throw InputError("", "", "a level needs at least one metaball");
  }
  const fs::path data_folder = fs::path(project->Resolve(project->survey_file_)).parent_path();
  const ProjectLock lock(project->path_, data_folder.string());
  project->CheckUnchanged();

  control.Report("reading the survey", 0);
  const auto survey = project->LoadSurveyFromCache(PartOf(control, 0, 0.05));
  const PreparedPoints points =
      PrepareForLevels(std::move(survey->points), *survey, options, PartOf(control, 0.05, 0.4));
  for (std::size_t i = 0; i < targets.size(); ++i) {
    control.ThrowIfStopped();
    const double share = 0.6 / static_cast<double>(targets.size());
    const double from = 0.4 + share * static_cast<double>(i);
    LevelOptions level_options = options;
    level_options.target_count = targets[i];
    const std::string name = FormatCount(targets[i]);
    const double built = from + (options.photo_colors ? 0.5 : 0.9) * share;
    Level level =
        BuildLevel(points, *survey, level_options, PartOf(control, from, built, name + ": "));
    if (options.photo_colors) {
      ColorFromPhotographs(*survey, {}, &level,
                           PartOf(control, built, from + 0.9 * share, name + ": "));
    }
    level.name = name;
    control.Report(name + ": writing", from + 0.9 * share);

    Scratch folder = WriteLevel(data_folder, level, control);

    LevelEntry entry;
    entry.name = name;
    entry.folder = folder.path().lexically_relative(project->Folder()).string();
    entry.stats = level.stats;
    entry.options = level_options;
    entry.program = SHERD_VERSION;
    std::vector<LevelEntry> before = project->levels_;
    fs::path replaced;
    const auto same = std::find_if(project->levels_.begin(), project->levels_.end(),
                                   [&](const LevelEntry& e) { return e.name == name; });
    if (same != project->levels_.end()) {
      replaced = project->Resolve(same->folder);
      *same = entry;
    } else {
      project->levels_.push_back(entry);
    }
    std::stable_sort(project->levels_.begin(), project->levels_.end(),
                     [](const LevelEntry& a, const LevelEntry& b) {
                       return a.stats.target_count < b.stats.target_count;
                     });
    try {
      project->SaveLocked();
    } catch (...) {
      project->levels_ = std::move(before);
      throw;
    }
    folder.Keep();
    if (!replaced.empty()) RemoveOld(data_folder, replaced);
  }
  control.Report("built", 1);
}

}  // namespace sherd
