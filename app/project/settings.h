// Options are data: one table of settings feeds the command line, the desktop's widgets, the
// project file and the report.
#pragma once

#include <span>
#include <string_view>

namespace sherd {

struct SettingInfo {
  std::string_view name;      // as on the command line, without dashes: "radius-scale"
  std::string_view title;     // for a widget: "Radius factor"
  std::string_view unit;      // "", "deg", "px", "m"
  std::string_view help;      // one sentence
  double min, max, fallback;  // range (inclusive) and default
  int decimals;               // for widgets
};

std::span<const SettingInfo> Settings();
// The entry called `name`; Error when there is none (a fault of the program).
const SettingInfo& Setting(std::string_view name);

}  // namespace sherd
