// The folders of a project, listed once. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace sherd {

struct ScannedFile {
  std::string name;
  std::uint64_t bytes = 0;
};

struct ScannedFolder {
  std::string path;  // absolute
  int depth = 0;     // below the folder the scan began with
  std::vector<ScannedFile> files;
  std::vector<std::string> subfolders;  // names

  const ScannedFile* Find(std::string_view name) const;
  bool HasFolder(std::string_view name) const;
};

// `root` and what lies below it, parents before children, names sorted. Hidden folders and folders
// below `max_depth` are left out; links to folders are followed, each folder is listed once.
// Folders that may not be read are left out. At most `max_folders`.
std::vector<ScannedFolder> ScanFolders(const std::string& root, int max_depth = 5,
                                       std::size_t max_folders = 20000);

bool IsImageFileName(std::string_view name);
// Ascii letters made small.
std::string LowerCase(std::string_view text);
bool HasExtension(std::string_view name, std::string_view extension);  // without regard to case

}  // namespace sherd
