// The files of the photographs, by name.
#include <algorithm>
#include <filesystem>
#include <unordered_map>

#include "reconstruction/folder_scan.h"
#include "reconstruction/workspace.h"

namespace sherd {
namespace {

std::vector<std::string> Parts(std::string_view path) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  while (begin <= path.size()) {
    // Backslashes: a project that was made on Windows.
    std::size_t end = path.find_first_of("/\\", begin);
    if (end == std::string_view::npos) end = path.size();
    const std::string_view part = path.substr(begin, end - begin);
    if (!part.empty() && part != ".") parts.emplace_back(part);
    begin = end + 1;
  }
  return parts;
}

struct Candidate {
  std::string path;
  std::vector<std::string> parts;  // relative to its folder
  std::size_t folder = 0;
};

std::size_t CommonEnd(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  std::size_t n = 0;
  while (n < a.size() && n < b.size() && a[a.size() - 1 - n] == b[b.size() - 1 - n]) ++n;
  return n;
}

using Index = std::unordered_map<std::string, std::vector<std::size_t>>;

// The candidate that shares the longest end with `parts`: the whole relative name, or the only one
// with that end (the first of several folders that hold it at the same place).
const Candidate* BestCandidate(const std::vector<std::string>& parts,
                               const std::vector<Candidate>& candidates, const Index& index) {
  if (parts.empty()) return nullptr;
  const auto found = index.find(parts.back());
  if (found == index.end()) return nullptr;
  const Candidate* best = nullptr;
  std::size_t best_length = 0;
  bool ambiguous = false;
  for (const std::size_t i : found->second) {
    const Candidate& candidate = candidates[i];
    const std::size_t length = CommonEnd(parts, candidate.parts);
    // The whole name at the folder's top beats the same end somewhere below it.
    const bool exact = candidate.parts == parts;
    const bool best_exact = best && best->parts == parts;
    if (!best || length > best_length || (length == best_length && exact && !best_exact)) {
      best = &candidate;
      best_length = length;
      ambiguous = false;
    } else if (length == best_length && exact == best_exact && candidate.parts != best->parts) {
      ambiguous = true;
    }
  }
  return ambiguous ? nullptr : best;
}

}  // namespace

std::size_t FindPhotographs(const std::vector<std::string>& folders,
                            std::vector<Photograph>* photographs) {
  std::vector<Candidate> candidates;
  for (std::size_t f = 0; f < folders.size(); ++f) {
    if (folders[f].empty()) continue;
    for (const ScannedFolder& folder : ScanFolders(folders[f], 8)) {
      for (const ScannedFile& file : folder.files) {
        Candidate candidate;
        candidate.path = folder.path + "/" + file.name;
        candidate.parts = Parts(candidate.path.substr(folders[f].size()));
        candidate.folder = f;
        candidates.push_back(std::move(candidate));
      }
    }
  }
  std::vector<std::string> found(photographs->size());
  for (const bool ignore_case : {false, true}) {
    std::vector<Candidate> folded;
    Index index;
    if (ignore_case) {
      folded = candidates;
      for (Candidate& candidate : folded) {
        for (std::string& part : candidate.parts) part = LowerCase(part);
      }
    }
    const std::vector<Candidate>& all = ignore_case ? folded : candidates;
    for (std::size_t i = 0; i < all.size(); ++i) index[all[i].parts.back()].push_back(i);
    for (std::size_t i = 0; i < photographs->size(); ++i) {
      if (!found[i].empty()) continue;
      std::vector<std::string> parts = Parts((*photographs)[i].name);
      if (ignore_case) {
        for (std::string& part : parts) part = LowerCase(part);
      }
      if (const Candidate* best = BestCandidate(parts, all, index)) found[i] = best->path;
    }
  }
  // cam1/a.jpg and cam2/a.jpg cannot both be the one a.jpg that was found: neither is believed.
  std::unordered_map<std::string, int> uses;
  for (const std::string& path : found) {
    if (!path.empty()) ++uses[path];
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < photographs->size(); ++i) {
    Photograph& photo = (*photographs)[i];
    photo.path = !found[i].empty() && uses[found[i]] == 1 ? found[i] : std::string();
    count += !photo.path.empty();
  }
  return count;
}

}  // namespace sherd
