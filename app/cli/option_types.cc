#include "app/cli/option_types.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "app/project/format.h"
#include "app/project/settings.h"
#include "metaball/error.h"
#include "reconstruction/level.h"

namespace sherd::cli {
namespace {

// The whole of `text` as a number; nullopt for anything else.
template <class T>
std::optional<T> ParseNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  T value{};
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  if (text.empty() || result.ec != std::errc() || result.ptr != end) return std::nullopt;
  return value;
}

std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

}  // namespace

CLI::Option* AddParsed(CLI::App* app, const std::string& name, const std::string& help,
                       std::function<void(const std::string&)> parse) {
  return app->add_option_function<std::string>(
      name,
      [name, parse = std::move(parse)](const std::string& text) {
        try {
          parse(text);
        } catch (const Error& error) {
          throw CLI::ValidationError(name, error.what());
        }
      },
      help);
}

Vec3d ParseVector(const std::string& text) {
  const std::vector<std::string> parts = Split(text, ',');
  Vec3d v;
  double* const axes[] = {&v.x, &v.y, &v.z};
  bool good = parts.size() == 3;
  for (std::size_t i = 0; good && i < 3; ++i) {
    const std::optional<double> number = ParseNumber<double>(parts[i]);
    good = number && std::isfinite(*number);
    if (good) *axes[i] = *number;
  }
  if (!good) {
    throw InputError("", "", "\"" + text + "\" is no vector", "give x,y,z without blanks");
  }
  return v;
}

Vec3d ParseDirection(const std::string& text) {
  const bool negative = text.starts_with('-'), signed_axis = negative || text.starts_with('+');
  const std::string axis = text.substr(signed_axis ? 1 : 0);
  const double length = negative ? -1 : 1;
  if (axis == "x") return {length, 0, 0};
  if (axis == "y") return {0, length, 0};
  if (axis == "z") return {0, 0, length};
  return ParseVector(text);
}

Size ParseSize(const std::string& text) {
  const std::vector<std::string> parts = Split(text, 'x');
  if (parts.size() == 2) {
    const std::optional<int> width = ParseNumber<int>(parts[0]);
    const std::optional<int> height = ParseNumber<int>(parts[1]);
    if (width && height && *width > 0 && *height > 0) return {*width, *height};
  }
  throw InputError("", "", "\"" + text + "\" is no size",
                   "give width and height in pixels, as in 1280x720");
}

std::vector<std::uint64_t> ParseCounts(const std::string& text) {
  std::vector<std::uint64_t> counts;
  for (const std::string& part : Split(text, ',')) {
    const std::uint64_t count = ParseCount(part);
    if (count == 0) throw InputError("", "", "a level needs at least one metaball");
    if (std::find(counts.begin(), counts.end(), count) == counts.end()) counts.push_back(count);
  }
  return counts;
}

CLI::Option* AddVector(CLI::App* app, const std::string& name, std::optional<Vec3d>* value,
                       const std::string& help) {
  return AddParsed(app, name, help,
                   [value](const std::string& text) { *value = ParseVector(text); })
      ->type_name("X,Y,Z");
}

CLI::Option* AddDirection(CLI::App* app, const std::string& name, std::optional<Vec3d>* value,
                          const std::string& help) {
  return AddParsed(app, name, help,
                   [value](const std::string& text) {
                     const Vec3d direction = ParseDirection(text);
                     if (!(Length(direction) > 0 && Length(direction) < INFINITY)) {
                       throw InputError("", "", "\"" + text + "\" is no direction",
                                        "its length must be above 0");
                     }
                     *value = direction;
                   })
      ->type_name("X,Y,Z|AXIS");
}

CLI::Option* AddSize(CLI::App* app, std::optional<Size>* value, const std::string& help) {
  return AddParsed(app, "--size", help,
                   [value](const std::string& text) { *value = ParseSize(text); })
      ->type_name("WxH");
}

CLI::Option* AddSetting(CLI::App* app, const std::string& name, std::optional<double>* value,
                        const std::string& type_name) {
  const SettingInfo& setting = Setting(name);
  const std::string range = FormatNumber(setting.min) + " to " + FormatNumber(setting.max);
  std::string help(setting.help);
  help += " [" + range;
  if (setting.fallback >= setting.min) help += ", default " + FormatNumber(setting.fallback);
  help += "]";
  return AddParsed(app, "--" + name, help,
                   [value, &setting, range](const std::string& text) {
                     const std::optional<double> number = ParseNumber<double>(text);
                     const bool whole =
                         setting.decimals > 0 || !number || *number == std::floor(*number);
                     if (!number || !whole || !(*number >= setting.min && *number <= setting.max)) {
                       throw InputError("", "",
                                        "\"" + text + "\" is not a " +
                                            (setting.decimals == 0 ? "whole " : "") +
                                            "number from " + range);
                     }
                     *value = number;
                   })
      ->type_name(type_name);
}

double ValueOf(const std::string& name, const std::optional<double>& value) {
  return value.value_or(Setting(name).fallback);
}

CLI::Option* AddKnownDistance(CLI::App* app, std::optional<KnownDistance>* value) {
  const std::string name = "--distance";
  return app
      ->add_option_function<std::vector<std::string>>(
          name,
          [name, value](const std::vector<std::string>& texts) {
            try {
              KnownDistance distance{ParseVector(texts.at(0)), ParseVector(texts.at(1))};
              const std::optional<double> metres = ParseNumber<double>(texts.at(2));
              if (!metres) throw InputError("", "", "\"" + texts[2] + "\" is no length in metres");
              distance.metres = *metres;
              ScaleOf(distance);
              *value = distance;
            } catch (const Error& error) {
              throw CLI::ValidationError(name, error.what());
            }
          },
          "the scale from two points of the project and their distance in metres")
      ->expected(3)
      ->type_name("X,Y,Z X,Y,Z M");
}

CLI::Option* AddDevice(CLI::App* app, std::string* value, const std::string& help) {
  return AddParsed(app, "--device", help,
                   [value](const std::string& text) {
                     GpuChoice(text);
                     *value = text;
                   })
      ->type_name("N|all");
}

DeviceChoice GpuChoice(const std::string& device) { return ParseDeviceChoice("cuda:" + device); }

CLI::Option* AddChoice(CLI::App* app, const std::string& name, std::string* value,
                       const std::vector<std::string>& words, const std::string& help) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : "|") + word;
  return AddParsed(app, name, help,
                   [value, words, all](const std::string& text) {
                     if (std::find(words.begin(), words.end(), text) == words.end()) {
                       throw InputError("", "", "\"" + text + "\" is none of " + all);
                     }
                     *value = text;
                   })
      ->type_name(all);
}

}  // namespace sherd::cli
