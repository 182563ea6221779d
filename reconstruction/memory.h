// How much memory there is. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <string>

namespace sherd {

// Memory that can be had without swapping, in bytes: the system's, or what the control group leaves
// if that is less. 0 where it cannot be told.
std::uint64_t AvailableMemoryBytes();

// `asked`, or where that is 0, 80 % of what is available; the largest number where that cannot be
// told. Bytes.
std::uint64_t MemoryLimit(std::uint64_t asked);

// Throws ResourceError when `needed` bytes exceed MemoryLimit(limit). `what` is named in the
// message with both figures and the way out.
void CheckMemory(const std::string& what, std::uint64_t needed, std::uint64_t limit = 0);

}  // namespace sherd
