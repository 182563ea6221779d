// Options in the program's own types, each checked with a message that names the option.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/project/project.h"
#include "cuda/device_choice.h"
#include "metaball/vec.h"

namespace sherd::cli {

struct Size {
  int width = 0, height = 0;
};

// "x,y,z"; finite numbers. Throws InputError.
Vec3d ParseVector(const std::string& text);
// The same, or an axis: "z", "+y", "-x".
Vec3d ParseDirection(const std::string& text);
// "1280x720". Throws InputError.
Size ParseSize(const std::string& text);
// "63k,126k" as counts, each once. Throws InputError.
std::vector<std::uint64_t> ParseCounts(const std::string& text);

// An option whose text goes through `parse`, whose Error becomes one of the option.
CLI::Option* AddParsed(CLI::App* app, const std::string& name, const std::string& help,
                       std::function<void(const std::string&)> parse);
CLI::Option* AddVector(CLI::App* app, const std::string& name, std::optional<Vec3d>* value,
                       const std::string& help);
// The same, refusing the zero vector.
CLI::Option* AddDirection(CLI::App* app, const std::string& name, std::optional<Vec3d>* value,
                          const std::string& help);
CLI::Option* AddSize(CLI::App* app, std::optional<Size>* value, const std::string& help);
// An option of the settings table (settings.h): its range is checked, its help and default shown.
CLI::Option* AddSetting(CLI::App* app, const std::string& name, std::optional<double>* value,
                        const std::string& type_name);
// The value or the table's default.
double ValueOf(const std::string& name, const std::optional<double>& value);
// "--distance P1 P2 METRES".
CLI::Option* AddKnownDistance(CLI::App* app, std::optional<KnownDistance>* value);
// "--device": the number of a GPU, or "all", as `value` then holds it.
CLI::Option* AddDevice(CLI::App* app, std::string* value, const std::string& help);
// What such a value means. Throws InputError.
DeviceChoice GpuChoice(const std::string& device);
// One of a few words.
CLI::Option* AddChoice(CLI::App* app, const std::string& name, std::string* value,
                       const std::vector<std::string>& words, const std::string& help);

}  // namespace sherd::cli
