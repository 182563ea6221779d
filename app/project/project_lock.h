// One program at a time works on a project: an advisory lock on its data folder.
#pragma once

#include <string>

namespace sherd {

class ProjectLock {
 public:
  // Makes the folder where it is missing (removed again by the destructor while it is empty).
  // Throws OutputError when another program holds the lock or the folder cannot be made.
  ProjectLock(const std::string& project_path, const std::string& data_folder);
  ~ProjectLock();
  ProjectLock(const ProjectLock&) = delete;
  ProjectLock& operator=(const ProjectLock&) = delete;

 private:
  std::string folder_;
  int fd_ = -1;
};

}  // namespace sherd
