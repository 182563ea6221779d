// Numbers for people, the same on every screen and in every file: independent of the locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace sherd {

// `significant` digits, 1..17; plain notation between 1e-4 and 1e7, else 1.2e+09. Trailing zeros
// after the decimal point are left out. "nan", "inf" for those.
std::string FormatNumber(double value, int significant = 4);
// The shortest text that reads back as the same double (for files).
std::string FormatExact(double value);
// 440996 -> "440,996".
std::string FormatGrouped(std::uint64_t value);
// 1536 -> "1.5 KiB"; up to TiB, three digits.
std::string FormatBytes(std::uint64_t bytes);
// 0.0123 -> "12 ms", 3.21 -> "3.2 s", 75 -> "1 min 15 s", 7300 -> "2 h 2 min".
std::string FormatSeconds(double seconds);
// A length in world units: in mm, m or km where the scale is known, else "0.0049 units".
std::string FormatLength(double world_units, const std::optional<double>& metres_per_unit,
                         int significant = 3);
// 0.0312 -> "3.1 %", 0.0018 -> "0.18 %", 0.24 -> "24 %".
std::string FormatShare(double share);

}  // namespace sherd
