// "63k" and back; the names of reductions.
#include <cctype>

#include "metaball/error.h"
#include "reconstruction/level.h"

namespace sherd {
namespace {

[[noreturn]] void FailCount(const std::string& text) {
  throw InputError("", "", "'" + text.substr(0, 40) + "' is no number of metaballs",
                   "write it like 63000, 63k or 1.5M");
}

}  // namespace

std::uint64_t ParseCount(const std::string& text) {
  std::size_t end = text.size();
  int zeros = 0;
  if (end > 0) {
    const char unit = static_cast<char>(std::tolower(static_cast<unsigned char>(text[end - 1])));
    zeros = unit == 'k' ? 3 : unit == 'm' ? 6 : 0;
    if (zeros > 0) --end;
  }
  // Digits are taken as integers all the way: "0.063k" is 63, exactly.
  constexpr std::uint64_t kMax = 1'000'000'000'000ull;
  std::uint64_t value = 0;
  bool point = false, digits = false;
  for (std::size_t i = 0; i < end; ++i) {
    if (text[i] == '.' && !point) {
      point = true;
      continue;
    }
    if (!std::isdigit(static_cast<unsigned char>(text[i]))) FailCount(text);
    digits = true;
    if (point && --zeros < 0) {
      if (text[i] != '0') FailCount(text);  // a fraction of a metaball
      continue;
    }
    value = value * 10 + static_cast<std::uint64_t>(text[i] - '0');
    if (value > kMax) FailCount(text);
  }
  for (; zeros > 0; --zeros) {
    value *= 10;
    if (value > kMax) FailCount(text);
  }
  if (!digits || value == 0) FailCount(text);
  return value;
}

std::string FormatCount(std::uint64_t count) {
  const auto in_units = [&](std::uint64_t unit, int places, char suffix) {
    std::string text = std::to_string(count / unit);
    std::string fraction = std::to_string(count % unit);
    fraction.insert(0, static_cast<std::size_t>(places) - fraction.size(), '0');
    while (!fraction.empty() && fraction.back() == '0') fraction.pop_back();
    if (!fraction.empty()) text += "." + fraction;
    return text + suffix;
  };
  if (count >= 1'000'000) return in_units(1'000'000, 6, 'M');
  if (count >= 1'000) return in_units(1'000, 3, 'k');
  return std::to_string(count);
}

namespace {
constexpr std::pair<const char*, Reduction> kReductions[] = {{"voxel", Reduction::kVoxel},
                                                             {"blue-noise", Reduction::kBlueNoise},
                                                             {"adaptive", Reduction::kAdaptive}};
}  // namespace

std::string ReductionName(Reduction reduction) {
  for (const auto& [name, value] : kReductions) {
    if (value == reduction) return name;
  }
  return "";
}

std::optional<Reduction> FindReduction(const std::string& name) {
  for (const auto& [known, value] : kReductions) {
    if (name == known) return value;
  }
  return std::nullopt;
}

std::vector<std::string> ReductionNames() {
  std::vector<std::string> names;
  for (const auto& [name, value] : kReductions) names.emplace_back(name);
  return names;
}

}  // namespace sherd
