#include "reconstruction/folder_scan.h"

#include <algorithm>
#include <deque>
#include <filesystem>
#include <set>

namespace sherd {

namespace fs = std::filesystem;

const ScannedFile* ScannedFolder::Find(std::string_view name) const {
  for (const ScannedFile& file : files) {
    if (file.name == name) return &file;
  }
  return nullptr;
}

bool ScannedFolder::HasFolder(std::string_view name) const {
  return std::find(subfolders.begin(), subfolders.end(), name) != subfolders.end();
}

std::vector<ScannedFolder> ScanFolders(const std::string& root, int max_depth,
                                       std::size_t max_folders) {
  std::vector<ScannedFolder> out;
  std::set<std::string> visited;  // canonical paths: links may lead round in circles
  std::deque<std::pair<std::string, int>> pending{{root, 0}};
  while (!pending.empty() && out.size() < max_folders) {
    const auto [path, depth] = pending.front();
    pending.pop_front();
    std::error_code error;
    const fs::path canonical = fs::canonical(path, error);
    if (error || !visited.insert(canonical.string()).second) continue;
    ScannedFolder folder;
    folder.path = path;
    folder.depth = depth;
    fs::directory_iterator it(path, fs::directory_options::skip_permission_denied, error);
    if (error) continue;
    for (; it != fs::directory_iterator(); it.increment(error)) {
      if (error) break;
      const std::string name = it->path().filename().string();
      std::error_code entry_error;
      if (it->is_directory(entry_error)) {
        if (!name.empty() && name.front() != '.') folder.subfolders.push_back(name);
      } else if (it->is_regular_file(entry_error)) {
        const std::uint64_t bytes = it->file_size(entry_error);
        folder.files.push_back({name, entry_error ? 0 : bytes});
      }
    }
    std::sort(folder.subfolders.begin(), folder.subfolders.end());
    std::sort(folder.files.begin(), folder.files.end(),
              [](const ScannedFile& a, const ScannedFile& b) { return a.name < b.name; });
    if (depth < max_depth) {
      for (const std::string& name : folder.subfolders) {
        pending.emplace_back((fs::path(path) / name).string(), depth + 1);
      }
    }
    out.push_back(std::move(folder));
  }
  return out;
}

std::string LowerCase(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return out;
}

bool HasExtension(std::string_view name, std::string_view extension) {
  return name.size() > extension.size() &&
         LowerCase(name.substr(name.size() - extension.size())) == extension;
}

bool IsImageFileName(std::string_view name) {
  for (const std::string_view extension : {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".jp2",
                                           ".webp", ".heic", ".exr", ".ppm", ".pgm"}) {
    if (HasExtension(name, extension)) return true;
  }
  return false;
}

}  // namespace sherd
