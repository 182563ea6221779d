#include "app/project/project.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "app/project/project_json.h"
#include "app/project/project_lock.h"
#include "metaball/atomic_file.h"
#include "metaball/error.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

std::string LevelNames(const std::vector<LevelEntry>& levels) {
  std::string names;
  for (const LevelEntry& level : levels) names += (names.empty() ? "" : ", ") + level.name;
  return names;
}

}  // namespace

std::string NoiseName(const LevelEntry& level) {
  return level.options.smooth_noise ? "smoothed" : "kept";
}

Project Project::Open(const std::string& path) {
  Project project;
  project.path_ = path;
  ProjectJson::Read(ProjectJson::Load(path), &project);
  return project;
}

bool Project::IsProjectFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  char begin[256] = {};
  in.read(begin, sizeof begin - 1);
  const std::string text(begin, static_cast<std::size_t>(in.gcount()));
  return text.find("\"format\"") != std::string::npos &&
         text.find("\"sherd project\"") != std::string::npos;
}

std::string Project::title() const { return fs::path(path_).stem().string(); }

std::string Project::Resolve(const std::string& relative) const {
  if (relative.empty()) return "";
  return (fs::path(Folder()) / relative).lexically_normal().string();
}

std::string Project::Folder() const {
  std::error_code error;
  return fs::absolute(path_, error).lexically_normal().parent_path().string();
}

void Project::SetUp(const Vec3d& up, const Survey& survey) {
  up_ = Normalized(up);
  front_ = EstimateFront(survey.photographs, up_);
}

void Project::Save() {
  const ProjectLock lock(path_, fs::path(Resolve(survey_file_)).parent_path().string());
  SaveLocked();
}

void Project::CheckUnchanged() const {
  if (!IsProjectFile(path_)) return;
  Project on_disk;
  on_disk.path_ = path_;
  try {
    ProjectJson::Read(ProjectJson::Load(path_), &on_disk);
  } catch (const InputError&) {
    return;  // damaged: saving mends it
  }
  if (on_disk.revision_ != revision_) {
    throw OutputError(path_, "was changed by another program since it was opened; open it again");
  }
}

void Project::SaveLocked() {
  CheckUnchanged();
  ++revision_;
  try {
    const std::string text = ProjectJson::Write(*this);
    AtomicFile file(path_);
    file.Write(text.data(), text.size());
    file.Commit();
  } catch (...) {
    --revision_;
    throw;
  }
}

const LevelEntry& Project::FindLevel(const std::string& name) const {
  for (const LevelEntry& level : levels_) {
    if (level.name == name) return level;
  }
  // "63000" and "0.063M" mean the same level.
  std::uint64_t count = 0;
  try {
    count = ParseCount(name);
  } catch (const InputError&) {
  }
  for (const LevelEntry& level : levels_) {
    if (count > 0 && level.stats.target_count == count) return level;
  }
  throw InputError(path_, "", "has no level \"" + name + "\"",
                   levels_.empty()
                       ? "build levels first: sherd build " + path_ + " --levels 63k,126k,252k,502k"
                       : "its levels are " + LevelNames(levels_));
}

const LevelEntry& Project::LargestLevel() const {
  const auto it = std::max_element(
      levels_.begin(), levels_.end(),
      [](const LevelEntry& a, const LevelEntry& b) { return a.stats.count < b.stats.count; });
  if (it == levels_.end()) {
    throw InputError(path_, "", "has no levels yet",
                     "build some first: sherd build " + path_ + " --levels 63k,126k,252k,502k");
  }
  return *it;
}

}  // namespace sherd
