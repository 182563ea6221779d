// Every kind of file Sherd reads from elsewhere, for the fuzz targets and for the test of what a
// damaged one may cost.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace sherd::fuzz {

struct FileKind {
  std::string group;  // the fuzz target: "sparse_bin"
  std::string name;   // of the file in its folder: "images.bin"
  // Reads `folder` + "/" + name as the program does; throws what the reader throws.
  void (*read)(const std::string& folder);
  // What must lie beside it: names and contents.
  std::vector<std::pair<std::string, std::string>> companions;
  std::vector<std::string> seeds;  // small, valid
  // Makes of arbitrary bytes what the reader does not refuse at once (a check sum); may be null.
  std::string (*complete)(std::string bytes) = nullptr;
};

const std::vector<FileKind>& FileKinds();

// A folder of the process's own, in memory where the machine has such a file system; removed with
// this object.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  // The folder in which files of `kind` are read, with what must lie beside them.
  std::string For(const FileKind& kind) const;

 private:
  std::string path_;
};

void WriteBytes(const std::string& path, const std::string& bytes);

}  // namespace sherd::fuzz
