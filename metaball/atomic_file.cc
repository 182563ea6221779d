#include "metaball/atomic_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "metaball/error.h"

namespace sherd {

AtomicFile::AtomicFile(const std::string& path)
    : path_(path), temporary_path_(path + ".tmp-" + std::to_string(getpid())) {
  file_ = std::fopen(temporary_path_.c_str(), "wb");
  if (!file_) {
    throw OutputError(path_, std::string("cannot be written: ") + std::strerror(errno));
  }
}

AtomicFile::~AtomicFile() {
  if (file_) std::fclose(file_);
  if (!committed_) std::remove(temporary_path_.c_str());
}

void AtomicFile::Write(const void* data, std::size_t bytes) {
  if (bytes > 0 && std::fwrite(data, 1, bytes, file_) != bytes) {
    throw OutputError(path_, std::string("writing failed: ") + std::strerror(errno));
  }
}

void AtomicFile::CloseForExternalWriter() {
  if (file_) std::fclose(file_);
  file_ = nullptr;
}

void AtomicFile::Commit() {
  if (file_) {
    const bool flushed = std::fflush(file_) == 0 && fsync(fileno(file_)) == 0;
    const int code = errno;
    std::fclose(file_);
    file_ = nullptr;
    if (!flushed) throw OutputError(path_, std::string("writing failed: ") + std::strerror(code));
  }
  if (std::rename(temporary_path_.c_str(), path_.c_str()) != 0) {
    throw OutputError(path_, std::string("cannot be replaced: ") + std::strerror(errno));
  }
  committed_ = true;
}

}  // namespace sherd
