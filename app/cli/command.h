// What every command of the program shares: how it is registered, how it ends, where it writes.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <string>

#include "metaball/control.h"

namespace sherd::cli {

using Json = nlohmann::ordered_json;

// docs/command_line.md lists them.
enum ExitCode : int {
  kSuccess = 0,
  kComparisonFailed = 1,
  kBadInput = 2,
  kOutputFailed = 3,
  kNoResources = 4,
  kCancelled = 130,
};

// What a command gets to know of the program around it.
struct Environment {
  std::stop_token stop;
};

// A command line sets `action` to what is to be done; it returns the exit code.
using Action = std::function<int(const Environment&)>;

// Each of these adds one command to the program. One file a command.
void AddInfo(CLI::App* program, Action* action);
void AddReconstruct(CLI::App* program, Action* action);
void AddImport(CLI::App* program, Action* action);
void AddBuild(CLI::App* program, Action* action);
void AddRender(CLI::App* program, Action* action);
void AddCompare(CLI::App* program, Action* action);
void AddExport(CLI::App* program, Action* action);
void AddBench(CLI::App* program, Action* action);
void AddScale(CLI::App* program, Action* action);
void AddDevices(CLI::App* program, Action* action);

// "warning: ..." on stderr, in one line.
void Warn(const std::string& message);
// Indented JSON and a line end on stdout. Text that is not UTF-8 is shown with replacement
// characters. Throws OutputError when stdout cannot be written.
void PrintJson(const Json& json);
// The text on stdout. Throws OutputError when stdout cannot be written.
void Print(const std::string& text);
// The largest memory the process has held, bytes.
std::uint64_t PeakMemory();
// `text` without line ends, for messages of one line.
std::string OneLine(std::string text);

}  // namespace sherd::cli
