// Progress on a terminal: one line on stderr that is written again and again, with percent and the
// time that is left. Nothing where stderr is no terminal.
#pragma once

#include <chrono>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "metaball/control.h"

namespace sherd::cli {

// "reading points   42 %   about 12 s left", at most `columns` wide. The time is left out while
// nothing can be said about it.
std::string ProgressLine(std::string_view what, double fraction, double elapsed_s, int columns);

class Progress {
 public:
  explicit Progress(std::stop_token stop);
  ~Progress();  // clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // For the work; must not outlive this object.
  const Control& control() const { return control_; }
  // Clears the line so that something else can be printed.
  void Clear();

 private:
  void Show(std::string_view what, double fraction);

  Control control_;
  bool terminal_ = false, shown_ = false;
  double furthest_ = 0;
  std::string last_what_;
  std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace sherd::cli
