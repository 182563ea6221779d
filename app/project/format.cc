#include "app/project/format.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace sherd {
namespace {

std::string ToChars(double value, std::chars_format format, int precision) {
  char buffer[400];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value, format, precision);
  return {buffer, result.ptr};
}

}  // namespace

std::string FormatNumber(double value, int significant) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  if (value == 0) return "0";
  significant = std::clamp(significant, 1, 17);
  // The exponent after rounding to the digits asked for: 9.996 with three is 10.0, not 9.100.
  const std::string scientific = ToChars(value, std::chars_format::scientific, significant - 1);
  const std::size_t e = scientific.find('e');
  const int exponent = std::stoi(scientific.substr(e + 1));
  if (exponent < -4 || exponent >= 7) {
    std::string mantissa = scientific.substr(0, e);
    if (mantissa.find('.') != std::string::npos) {
      mantissa.erase(mantissa.find_last_not_of('0') + 1);
      if (mantissa.back() == '.') mantissa.pop_back();
    }
    return mantissa + scientific.substr(e);
  }
  const int decimals = std::max(0, significant - 1 - exponent);
  std::string text = ToChars(value, std::chars_format::fixed, decimals);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text;
}

std::string FormatExact(double value) {
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, result.ptr};
}

std::string FormatGrouped(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (int i = static_cast<int>(text.size()) - 3; i > 0; i -= 3) {
    text.insert(static_cast<std::size_t>(i), 1, ',');
  }
  return text;
}

std::string FormatBytes(std::uint64_t bytes) {
  if (bytes < 1024) return std::to_string(bytes) + " B";
  static constexpr const char* kUnits[] = {"KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes) / 1024;
  int unit = 0;
  while (value >= 1023.5 && unit < 3) {
    value /= 1024;
    ++unit;
  }
  return FormatNumber(value, value < 99.95 ? 3 : 4) + " " + kUnits[unit];
}

std::string FormatSeconds(double seconds) {
  if (!(seconds >= 0)) return "?";
  if (seconds < 0.0995) return FormatNumber(seconds * 1e3, 2) + " ms";
  if (seconds < 9.95) return FormatNumber(seconds, 2) + " s";
  const auto whole = static_cast<std::uint64_t>(std::min(seconds, 1e15) + 0.5);
  if (whole < 60) return std::to_string(whole) + " s";
  if (whole < 3600) {
    return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  }
  return std::to_string(whole / 3600) + " h " + std::to_string(whole % 3600 / 60) + " min";
}

std::string FormatLength(double world_units, const std::optional<double>& metres_per_unit,
                         int significant) {
  if (!metres_per_unit) return FormatNumber(world_units, significant) + " units";
  const double metres = world_units * *metres_per_unit;
  const double size = std::abs(metres);
  // Half a unit in the last digit decides, so that 0.9999 m does not become 1000 mm.
  const double slack = 1 - 0.5 * std::pow(10.0, -significant);
  if (size >= 1000 * slack) return FormatNumber(metres / 1000, significant) + " km";
  if (size >= slack || size == 0) return FormatNumber(metres, significant) + " m";
  return FormatNumber(metres * 1000, significant) + " mm";
}

std::string FormatShare(double share) {
  const double percent = share * 100;
  if (percent == 0) return "0 %";
  if (percent > 0 && percent < 0.01) return "< 0.01 %";
  const int decimals = percent < 1 ? 2 : percent < 10 ? 1 : 0;
  return ToChars(percent, std::chars_format::fixed, decimals) + " %";
}

}  // namespace sherd
