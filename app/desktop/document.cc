#include "app/desktop/document.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "metaball/error.h"
#include "metaball/median.h"
#include "metaball/metaball_file.h"
#include "metaball/scene.h"
#include "reconstruction/ply.h"
#include "reconstruction/workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

std::string LowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

std::vector<Vec3d> WorldCenters(const Cloud& cloud) {
  std::vector<Vec3d> centers(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    centers[i] = cloud.frame.WorldFromLocal(cloud.center[i]);
  }
  return centers;
}

// The figures a project keeps for its levels, for a cloud that came without them.
LevelStats StatsOf(const Cloud& cloud, const std::vector<double>& spacing, double threshold) {
  LevelStats stats;
  stats.source_points = stats.target_count = stats.count = cloud.size();
  stats.threshold = threshold;
  stats.cloud_bytes = cloud.MemoryBytes();
  stats.spacing = Median(spacing);
  std::vector<double> radii(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) radii[i] = cloud.RadiusOf(i) * cloud.frame.unit;
  if (!radii.empty()) {
    const auto [least, greatest] = std::minmax_element(radii.begin(), radii.end());
    stats.radius_min = *least;
    stats.radius_max = *greatest;
    stats.radius_median = Median(radii);
  }
  return stats;
}

Level LevelFromPly(const std::string& path, const Control& control) {
  control.Report("Reading " + fs::path(path).filename().string(), 0.0);
  PlyCloud ply = ReadPly(path, control);
  if (ply.position.empty()) {
    throw InputError(path, "", "holds no points", "choose a point cloud with at least one vertex");
  }
  control.ThrowIfStopped();
  CloudInput input;
  std::vector<double> spacing;
  if (ply.radius.empty()) {
    control.Report("Measuring the spacing", 0.6);
    input.radius = RadiiFromSpacing(ply.position, 0.0, &spacing);
  } else {
    input.radius = std::move(ply.radius);
  }
  control.ThrowIfStopped();
  control.Report("Sorting the metaballs", 0.8);
  input.center = std::move(ply.position);
  input.color = std::move(ply.color);
  Level level;
  level.cloud = BuildCloud(input);
  if (level.cloud.empty()) {
    throw InputError(path, "", "no point has finite coordinates and a positive radius",
                     "check the file's x, y, z and radius properties");
  }
  if (spacing.empty()) RadiiFromSpacing(WorldCenters(level.cloud), 0.0, &spacing);
  level.stats = StatsOf(level.cloud, spacing, Surface{}.threshold);
  return level;
}

Level LevelFromMetaballs(const std::string& path, const Control& control) {
  control.Report("Reading " + fs::path(path).filename().string(), 0.0);
  MetaballFile file = ReadMetaballFile(path);
  control.ThrowIfStopped();
  control.Report("Measuring the spacing", 0.5);
  std::vector<double> spacing;
  if (!file.cloud.empty()) RadiiFromSpacing(WorldCenters(file.cloud), 0.0, &spacing);
  Level level;
  level.stats = StatsOf(file.cloud, spacing, file.threshold);
  level.cloud = std::move(file.cloud);
  return level;
}

}  // namespace

std::shared_ptr<Document> Document::OpenProject(const std::string& path) {
  return FromProject(Project::Open(path));
}

std::shared_ptr<Document> Document::FromProject(Project project) {
  auto document = std::shared_ptr<Document>(new Document);
  document->path_ = project.path();
  document->title_ = project.title();
  document->levels_ = project.levels();
  // The finest level last, whatever the order they were built in.
  std::stable_sort(
      document->levels_.begin(), document->levels_.end(),
      [](const LevelEntry& a, const LevelEntry& b) { return a.stats.count < b.stats.count; });
  document->bounds_ = project.bounds();
  document->up_ = project.up();
  document->front_ = project.front();
  document->metres_per_unit_ = project.metres_per_unit();
  document->project_ = std::move(project);
  for (std::size_t i = 0; i < document->levels_.size(); ++i) {
    document->caches_.push_back(std::make_unique<LevelCache>());
  }
  return document;
}

std::shared_ptr<Document> Document::OpenCloud(const std::string& path, const Control& control) {
  auto document = std::shared_ptr<Document>(new Document);
  document->path_ = path;
  document->title_ = fs::path(path).stem().string();
  auto level =
      std::make_shared<Level>(LowerExtension(path) == ".ply" ? LevelFromPly(path, control)
                                                             : LevelFromMetaballs(path, control));
  level->name = FormatCount(level->cloud.size());
  document->levels_.push_back({level->name, "", level->stats});
  document->bounds_ = RobustBounds(WorldCenters(level->cloud));
  document->own_level_ = std::move(level);
  control.Report("Done", 1.0);
  return document;
}

bool Document::HasPhotographs() const {
  return project_ && project_->import_summary().photographs > 0;
}

std::shared_ptr<const Level> Document::LoadLevel(std::size_t level_idx, const Control& control) {
  if (own_level_) return own_level_;
  if (level_idx >= levels_.size()) throw Error("the project has no such level");
  LevelCache& cache = *caches_[level_idx];
  // Two panes that want one level load it once.
  const std::lock_guard lock(cache.loading);
  if (auto level = cache.level.lock()) return level;
  auto level = project_->LoadLevel(levels_[level_idx].name, control);
  cache.level = level;
  return level;
}

std::shared_ptr<const Survey> Document::LoadSurvey(const Control& control) {
  if (!project_) return nullptr;
  const std::lock_guard lock(survey_loading_);
  if (auto survey = survey_.lock()) return survey;
  auto survey = project_->LoadSurveyFromCache(control);
  survey_ = survey;
  return survey;
}

std::shared_ptr<Document> Document::WithScale(std::optional<double> metres_per_unit) const {
  auto document = std::shared_ptr<Document>(new Document);
  document->path_ = path_;
  document->title_ = title_;
  document->project_ = project_;
  if (document->project_) document->project_->SetMetresPerUnit(metres_per_unit);
  document->levels_ = levels_;
  document->bounds_ = bounds_;
  document->up_ = up_;
  document->front_ = front_;
  document->metres_per_unit_ = metres_per_unit;
  document->own_level_ = own_level_;
  for (const auto& cache : caches_) {
    document->caches_.push_back(std::make_unique<LevelCache>());
    // Who cannot be asked without waiting is loaded again when it is wanted.
    const std::unique_lock lock(cache->loading, std::try_to_lock);
    if (lock) document->caches_.back()->level = cache->level;
  }
  const std::unique_lock lock(survey_loading_, std::try_to_lock);
  if (lock) document->survey_ = survey_;
  return document;
}

void Document::SaveProject() {
  if (project_) project_->Save();
}

PathKind ClassifyPath(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) {
    throw InputError(path, "", "there is no such file or folder", "check the name");
  }
  if (fs::is_directory(status)) return PathKind::kWorkspace;
  const std::string extension = LowerExtension(path);
  if (extension == ".sherd" || Project::IsProjectFile(path)) return PathKind::kProject;
  if (extension == kMetaballExtension || IsMetaballFile(path)) return PathKind::kCloud;
  if (extension == ".ply" && ReadPlyHeader(path).has_radius) return PathKind::kCloud;
  return PathKind::kWorkspace;
}

std::vector<std::uint64_t> SuggestLevels(std::uint64_t points) {
  constexpr std::uint64_t kDefault[] = {63000, 126000, 252000, 502000};
  std::vector<std::uint64_t> levels;
  if (points == 0) return levels;
  // At least two of the defaults, or they would not be a comparison.
  if (points >= kDefault[1]) {
    for (const std::uint64_t level : kDefault) {
      if (level <= points) levels.push_back(level);
    }
    return levels;
  }
  for (int halvings = 3; halvings >= 0; --halvings) {
    std::uint64_t level = points >> halvings;
    // Round down to two digits, so that the names are short.
    std::uint64_t step = 1;
    while (level / step >= 100) step *= 10;
    level = level / step * step;
    if (level >= 100 || halvings == 0) levels.push_back(level);
  }
  return levels;
}

}  // namespace sherd
