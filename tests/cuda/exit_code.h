// How the checking and measuring programs end.
#pragma once

#include <exception>
#include <iostream>
#include <stdexcept>

namespace sherd {

// What run() returns; where it throws, one line on stderr, and 2 for what was asked for
// (std::invalid_argument), else 1.
template <class Run>
int ExitCodeOf(const char* program, const Run& run) {
  try {
    return run();
  } catch (const std::invalid_argument& error) {
    std::cerr << program << ": " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << program << ": " << error.what() << "\n";
    return 1;
  }
}

}  // namespace sherd
