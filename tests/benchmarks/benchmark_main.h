// What the benchmarks' mains share.
#pragma once

#include <fstream>
#include <iostream>
#include <string>

#include "metaball/error.h"

namespace sherd::benchmarks {

// Runs a benchmark; an Error is one line and exit code 2.
inline int RunMain(const char* name, int (*run)(int, char**), int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const Error& error) {
    std::cerr << name << ": " << error.what() << "\n";
    return 2;
  }
}

// The figures as a file; none where no path is given.
template <class Json>
void WriteJson(const std::string& path, const Json& figures) {
  if (!path.empty()) std::ofstream(path) << figures.dump(1) << "\n";
}

}  // namespace sherd::benchmarks
