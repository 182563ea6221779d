// The files of a project as its stages write and replace them. Internal to app/project/.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "metaball/control.h"
#include "reconstruction/level.h"

namespace sherd {

// NAME.EXT in `folder`, or NAME-2.EXT, ... : the first that does not exist.
std::filesystem::path FreeName(const std::filesystem::path& folder, const std::string& name,
                               const std::string& extension);

// Removes what it names unless told that it is to stay.
class Scratch {
 public:
  explicit Scratch(std::filesystem::path path) : path_(std::move(path)) {}
  ~Scratch();
  Scratch(Scratch&& other) noexcept : path_(std::move(other.path_)), keep_(other.keep_) {
    other.keep_ = true;
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }
  void Keep() { keep_ = true; }

 private:
  std::filesystem::path path_;
  bool keep_ = false;
};

// Writes a level's folder under a free name. Throws OutputError, Cancelled.
Scratch WriteLevel(const std::filesystem::path& data_folder, const Level& level,
                   const Control& control);

// Removes a file or folder that an older state of the project named. Only what lies in the data
// folder is ever removed, whatever the JSON says.
void RemoveOld(const std::filesystem::path& data_folder, const std::filesystem::path& old);

}  // namespace sherd
