// Writing a file so that it is there whole or not at all: a temporary name beside it, then a
// rename.
#pragma once

#include <cstdio>
#include <string>

namespace sherd {

class AtomicFile {
 public:
  // Opens PATH.tmp-<pid> in the same folder. Throws OutputError when that is not possible.
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();  // without Commit: the temporary file is removed
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  // The temporary file, for libraries that open by name.
  const std::string& temporary_path() const { return temporary_path_; }
  // Throws OutputError (disk full and the like).
  void Write(const void* data, std::size_t bytes);
  // Flushes to the disk and renames. Throws OutputError.
  void Commit();
  // For libraries that write to temporary_path() themselves: closes our handle, keeps the name.
  void CloseForExternalWriter();

 private:
  std::string path_, temporary_path_;
  std::FILE* file_ = nullptr;
  bool committed_ = false;
};

}  // namespace sherd
