// Decoded photographs within a bound of memory. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "metaball/control.h"
#include "reconstruction/photo_pyramid.h"

namespace sherd {

class PhotoStore {
 public:
  explicit PhotoStore(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  struct Request {
    std::string path;
    int width = 0, height = 0;  // of the file
    int finest = 0;             // the finest level that is needed
  };
  // The pyramids of as many of `requests` (from `first` on) as fit in the bound together, at least
  // one: decoded in parallel where they are not held already, coarser than asked where one alone
  // would not fit. A photograph that cannot be read gives nullptr and a line in `problems`. What
  // was used longest ago makes room. The pointers stay valid as long as they are held.
  std::vector<std::shared_ptr<const PhotoPyramid>> Fetch(const std::vector<Request>& requests,
                                                         std::size_t first, const Control& control,
                                                         std::vector<std::string>* problems);

  // Whether nothing would have to be decoded for it.
  bool Holds(const Request& request) const;

  std::size_t MemoryBytes() const { return bytes_; }

 private:
  struct Entry {
    std::shared_ptr<const PhotoPyramid> pyramid;
    std::uint64_t used = 0;
  };
  // The finest level that is asked for and can be held.
  int FinestOf(const Request& request) const;
  void MakeRoom(std::size_t bytes, std::uint64_t keep_since);

  std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::uint64_t clock_ = 0;
  std::unordered_map<std::string, Entry> entries_;
};

}  // namespace sherd
