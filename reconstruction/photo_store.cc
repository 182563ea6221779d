#include "reconstruction/photo_store.h"

#include <algorithm>

#include "metaball/error.h"
#include "reconstruction/parallel.h"

namespace sherd {

void PhotoStore::MakeRoom(std::size_t bytes, std::uint64_t keep_since) {
  while (bytes_ + bytes > max_bytes_) {
    auto oldest = entries_.end();
    for (auto it = entries_.begin(); it != entries_.end(); ++it) {
      if (it->second.used >= keep_since) continue;
      if (oldest == entries_.end() || it->second.used < oldest->second.used) oldest = it;
    }
    if (oldest == entries_.end()) return;
    bytes_ -= oldest->second.pyramid->MemoryBytes();
    entries_.erase(oldest);
  }
}

int PhotoStore::FinestOf(const Request& request) const {
  int level = request.finest;
  while (PhotoPyramid::BytesFor(request.width, request.height, level) > max_bytes_ && level < 24) {
    ++level;
  }
  return level;
}

bool PhotoStore::Holds(const Request& request) const {
  const auto held = entries_.find(request.path);
  return held != entries_.end() && held->second.pyramid->finest() <= FinestOf(request);
}

std::vector<std::shared_ptr<const PhotoPyramid>> PhotoStore::Fetch(
    const std::vector<Request>& requests, std::size_t first, const Control& control,
    std::vector<std::string>* problems) {
  constexpr std::size_t kMostAtOnce = 16;
  const std::uint64_t now = clock_ + 1;
  std::vector<std::shared_ptr<const PhotoPyramid>> out;
  std::vector<std::size_t> to_decode;  // positions in `out`
  std::vector<int> finest;
  std::size_t planned = 0;
  for (std::size_t i = first; i < requests.size() && out.size() < kMostAtOnce; ++i) {
    const Request& request = requests[i];
    const int level = FinestOf(request);
    const std::size_t bytes = PhotoPyramid::BytesFor(request.width, request.height, level);
    if (i > first && planned + bytes > max_bytes_) break;
    planned += bytes;
    const auto held = entries_.find(request.path);
    if (Holds(request)) {
      held->second.used = ++clock_;
      out.push_back(held->second.pyramid);
    } else {
      if (held != entries_.end()) {
        bytes_ -= held->second.pyramid->MemoryBytes();
        entries_.erase(held);
      }
      to_decode.push_back(out.size());
      out.push_back(nullptr);
    }
    finest.push_back(level);
  }
  std::size_t new_bytes = 0;
  for (const std::size_t i : to_decode) {
    const Request& request = requests[first + i];
    new_bytes += PhotoPyramid::BytesFor(request.width, request.height, finest[i]);
  }
  MakeRoom(new_bytes, now);
  std::vector<std::string> problem(to_decode.size());
  ParallelBlocks(
      to_decode.size(), 1,
      [&](std::size_t begin, std::size_t) {
        const std::size_t i = to_decode[begin];
        try {
          out[i] = std::make_shared<const PhotoPyramid>(
              ReadPhotoPyramid(requests[first + i].path, finest[i]));
        } catch (const InputError& error) {
          problem[begin] = error.what();
        }
      },
      control);
  for (std::size_t j = 0; j < to_decode.size(); ++j) {
    const std::size_t i = to_decode[j];
    if (!out[i]) {
      problems->push_back(problem[j]);
      continue;
    }
    bytes_ += out[i]->MemoryBytes();
    entries_[requests[first + i].path] = {out[i], ++clock_};
  }
  return out;
}

}  // namespace sherd
