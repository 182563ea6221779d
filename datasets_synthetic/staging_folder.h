// A folder that appears whole or not at all: made under a temporary name beside its place and
// renamed at the end.
#pragma once

#include <string>

namespace sherd::synthetic {

class StagingFolder {
 public:
  // Makes FOLDER.tmp-<pid>. An existing `folder` must be empty or hold `marker` (a relative path
  // that says that it was made by us). Throws OutputError.
  StagingFolder(const std::string& folder, const std::string& marker);
  ~StagingFolder();  // without Commit: removes it and all that is in it
  StagingFolder(const StagingFolder&) = delete;
  StagingFolder& operator=(const StagingFolder&) = delete;

  const std::string& path() const { return temporary_; }
  // Makes a folder inside; returns its path.
  std::string Make(const std::string& relative) const;
  // Puts it into its place; what was there goes. Throws OutputError.
  void Commit();

 private:
  std::string folder_, temporary_;
  bool committed_ = false;
};

}  // namespace sherd::synthetic
