#include "tests/app/run_sherd.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>

#include "tests/app/test_workspace.h"

namespace sherd::testing {

RunResult RunSherd(const std::string& arguments, const std::string& before) {
  const std::string base = FreshFolder("run");
  // --backend cpu is not given: the machine's own choice is what a user gets.
  const std::string command = before + " '" SHERD_PROGRAM "' " + arguments + " >'" + base +
                              "/out' 2>'" + base + "/err' </dev/null";
  const int status = std::system(command.c_str());
  RunResult result;
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.out = ReadText(base + "/out");
  result.err = ReadText(base + "/err");
  return result;
}

void ExpectFailure(const RunResult& result, int code, const std::string& what) {
  EXPECT_EQ(result.code, code) << result.err;
  EXPECT_EQ(result.out, "");
  // A line that says why the GPU is not used may stand before it.
  std::string line = result.err;
  if (line.starts_with("CPU")) line = line.substr(line.find('\n') + 1);
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1) << line;
  EXPECT_THAT(line, ::testing::StartsWith("sherd: "));
  EXPECT_THAT(line, ::testing::HasSubstr(what));
}

}  // namespace sherd::testing
