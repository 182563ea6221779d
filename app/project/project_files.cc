#include "app/project/project_files.h"

#include <system_error>

#include "app/project/project.h"
#include "app/project/survey_file.h"
#include "metaball/error.h"
#include "metaball/metaball_file.h"

namespace sherd {

namespace fs = std::filesystem;

fs::path FreeName(const fs::path& folder, const std::string& name, const std::string& extension) {
  for (int i = 1;; ++i) {
    const std::string number = i == 1 ? std::string() : std::to_string(-i);
    const fs::path path = folder / (name + number + extension);
    if (!fs::exists(fs::symlink_status(path))) return path;
  }
}

Scratch::~Scratch() {
  std::error_code error;
  if (!keep_) fs::remove_all(path_, error);
}

Scratch WriteLevel(const fs::path& data_folder, const Level& level, const Control& control) {
  const Scratch temporary(data_folder / (level.name + ".building"));
  std::error_code error;
  fs::remove_all(temporary.path(), error);  // what a power cut left
  if (!fs::create_directory(temporary.path(), error)) {
    throw OutputError(temporary.path().string(), "cannot be made: " + error.message());
  }
  WriteMetaballFile((temporary.path() / "cloud.metaballs").string(), level.cloud,
                    level.stats.threshold);
  WriteLevelAttributes((temporary.path() / "attributes.bin").string(), level);
  control.ThrowIfStopped();
  Scratch folder(FreeName(data_folder, level.name, ""));
  fs::rename(temporary.path(), folder.path(), error);
  if (error) throw OutputError(folder.path().string(), "cannot be made: " + error.message());
  return folder;
}

void RemoveOld(const fs::path& data_folder, const fs::path& old) {
  std::error_code error;
  if (old.lexically_normal().parent_path() == data_folder.lexically_normal()) {
    fs::remove_all(old, error);
  }
}

void Project::RemoveFiles(const std::string& data_folder) const {
  for (const std::string& file : {survey_file_, outline_file_}) {
    if (!file.empty()) RemoveOld(data_folder, Resolve(file));
  }
  for (const LevelEntry& level : levels_) RemoveOld(data_folder, Resolve(level.folder));
}

}  // namespace sherd
