#include "app/project/project_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "metaball/error.h"

namespace sherd {

ProjectLock::ProjectLock(const std::string& project_path, const std::string& data_folder)
    : folder_(data_folder) {
  if (mkdir(folder_.c_str(), 0777) != 0 && errno != EEXIST) {
    throw OutputError(project_path,
                      "its data folder " + folder_ + " cannot be made: " + std::strerror(errno));
  }
  fd_ = open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd_ < 0) {
    throw OutputError(project_path,
                      "its data folder " + folder_ + " cannot be opened: " + std::strerror(errno));
  }
  if (flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    close(fd_);
    throw OutputError(project_path,
                      "another program is working on this project; wait until it has finished");
  }
}

ProjectLock::~ProjectLock() {
  rmdir(folder_.c_str());  // succeeds only where nothing was written into it
  close(fd_);
}

}  // namespace sherd
