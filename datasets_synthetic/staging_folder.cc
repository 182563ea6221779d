#include "datasets_synthetic/staging_folder.h"

#include <unistd.h>

#include <filesystem>

#include "metaball/error.h"

namespace sherd::synthetic {
namespace fs = std::filesystem;

StagingFolder::StagingFolder(const std::string& folder, const std::string& marker) {
  if (folder.empty()) throw OutputError("output folder", "no name was given");
  fs::path place = fs::absolute(folder).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();
  folder_ = place.string();
  std::error_code error;
  if (fs::exists(place, error)) {
    if (!fs::is_directory(place, error)) throw OutputError(folder, "exists and is not a folder");
    if (!fs::is_empty(place, error) && !fs::exists(place / marker, error)) {
      throw OutputError(folder,
                        "holds files that are not a synthetic excavation and would be lost; name "
                        "an empty or a new folder");
    }
  }
  const fs::path temporary = place.string() + ".tmp-" + std::to_string(::getpid());
  fs::remove_all(temporary, error);  // of a process with our number that was killed
  fs::create_directories(temporary, error);
  if (error) throw OutputError(temporary.string(), "cannot be made: " + error.message());
  temporary_ = temporary.string();
}

StagingFolder::~StagingFolder() {
  if (committed_ || temporary_.empty()) return;
  std::error_code error;
  fs::remove_all(temporary_, error);
}

std::string StagingFolder::Make(const std::string& relative) const {
  const fs::path path = fs::path(temporary_) / relative;
  std::error_code error;
  fs::create_directories(path, error);
  if (error) throw OutputError(path.string(), "cannot be made: " + error.message());
  return path.string();
}

void StagingFolder::Commit() {
  std::error_code error;
  const std::string old = folder_ + ".old-" + std::to_string(::getpid());
  const bool replaces = fs::exists(folder_, error);
  if (replaces) {
    fs::rename(folder_, old, error);
    if (error) throw OutputError(folder_, "cannot be replaced: " + error.message());
  }
  fs::rename(temporary_, folder_, error);
  if (error) {
    const std::string message = error.message();
    if (replaces) fs::rename(old, folder_, error);  // as it was
    throw OutputError(folder_, "cannot be made: " + message);
  }
  committed_ = true;
  if (replaces) fs::remove_all(old, error);
}

}  // namespace sherd::synthetic
