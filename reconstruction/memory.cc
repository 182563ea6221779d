#include "reconstruction/memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "metaball/error.h"

namespace sherd {
namespace {

std::optional<std::uint64_t> ReadNumber(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t value;
  if (file >> value) return value;  // "max" is none
  return std::nullopt;
}

std::string Gigabytes(std::uint64_t bytes) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(1);
  text << std::fixed << static_cast<double>(bytes) / 1e9 << " GB";
  return text.str();
}

}  // namespace

std::uint64_t AvailableMemoryBytes() {
  std::uint64_t available = 0;
  std::ifstream file("/proc/meminfo");
  std::string key;
  while (file >> key) {
    std::uint64_t kilobytes;
    if (key == "MemAvailable:" && file >> kilobytes) {
      available = kilobytes * 1024;
      break;
    }
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  // Containers: control groups version 2, then 1.
  for (const auto& [limit_path, used_path] :
       {std::pair{"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"},
        std::pair{"/sys/fs/cgroup/memory/memory.limit_in_bytes",
                  "/sys/fs/cgroup/memory/memory.usage_in_bytes"}}) {
    const auto limit = ReadNumber(limit_path);
    const auto used = ReadNumber(used_path);
    if (limit && used && available > 0) {
      available = std::min(available, *limit > *used ? *limit - *used : 0);
    }
  }
  return available;
}

std::uint64_t MemoryLimit(std::uint64_t asked) {
  if (asked > 0) return asked;
  const std::uint64_t free = AvailableMemoryBytes() / 5 * 4;
  return free > 0 ? free : std::numeric_limits<std::uint64_t>::max();
}

void CheckMemory(const std::string& what, std::uint64_t needed, std::uint64_t limit) {
  limit = MemoryLimit(limit);
  if (needed <= limit) return;
  throw ResourceError(
      what + ": needs about " + Gigabytes(needed) + " of memory, but only " + Gigabytes(limit) +
          " may be used; load a thinned cloud (decimation), or close other programs",
      needed, limit);
}

}  // namespace sherd
