// Another program, run to its end: its output watched line by line and kept, stopped with
// everything it has started.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "metaball/control.h"

namespace sherd {

struct ChildOutcome {
  int exit_code = -1;  // -1 where a signal ended it
  int signal = 0;      // 0: it ended by itself
  bool good() const { return exit_code == 0; }
};

// Runs argv[0] (looked for on the PATH) with its standard input closed, in a process group of its
// own, without a display (QT_QPA_PLATFORM=offscreen). What it prints is appended to the file `log`
// (none where empty) and given to `on_line`, which may be empty. When `control` is stopped the
// whole group is asked to end, killed after two seconds, and Cancelled is thrown. Throws InputError
// where there is no such program, OutputError where the log cannot be written (the group is killed
// then).
ChildOutcome RunChild(const std::vector<std::string>& argv, const std::string& log,
                      const std::function<void(std::string_view line)>& on_line,
                      const Control& control);

}  // namespace sherd
