// How a caller watches and stops long work. Passed by const reference; copying is cheap.
#pragma once

#include <functional>
#include <stop_token>
#include <string_view>

#include "metaball/error.h"

namespace sherd {

struct Control {
  // Called with what is being done and a fraction in [0, 1]. May be called from any thread, never
  // from two at once for one piece of work. May be empty.
  std::function<void(std::string_view what, double fraction)> progress;
  // Work asks this at intervals of at most about 50 ms and then throws Cancelled.
  std::stop_token stop;

  void Report(std::string_view what, double fraction) const {
    if (progress) progress(what, fraction);
  }
  bool stopped() const { return stop.stop_requested(); }
  void ThrowIfStopped() const {
    if (stopped()) throw Cancelled();
  }
};

}  // namespace sherd
