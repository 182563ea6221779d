// Runs the program as a script would.
#pragma once

#include <string>
#include <vector>

namespace sherd::testing {

struct RunResult {
  int code = -1;  // exit code; 128 + n when signal n ended it
  std::string out, err;
};

// `arguments` as one would type them in a shell (quote what needs it). `before` runs in the same
// shell before the program ("ulimit -f 16;").
RunResult RunSherd(const std::string& arguments, const std::string& before = "");

// What every failure has to look like: the code, exactly one line on stderr that begins with
// "sherd: " and holds `what`, and nothing on stdout.
void ExpectFailure(const RunResult& result, int code, const std::string& what);

}  // namespace sherd::testing
