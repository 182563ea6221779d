// app/project/format.h for Qt's strings, and what only a window needs.
#pragma once

#include <QString>
#include <cstdint>
#include <optional>

#include "app/project/format.h"

namespace sherd {

inline QString formatLength(double world_units, const std::optional<double>& metres_per_unit) {
  return QString::fromStdString(FormatLength(world_units, metres_per_unit));
}
inline QString formatSeconds(double seconds) {
  return QString::fromStdString(FormatSeconds(seconds));
}
inline QString formatInteger(std::uint64_t value) {
  return QString::fromStdString(FormatGrouped(value));
}
inline QString formatBytes(std::uint64_t bytes) {
  return QString::fromStdString(FormatBytes(bytes));
}
inline QString formatShare(double share) { return QString::fromStdString(FormatShare(share)); }

// A coordinate with as many decimals as `resolution` (the world size of a pixel, > 0) makes sense
// of.
QString formatCoordinate(double value, double resolution);

}  // namespace sherd
