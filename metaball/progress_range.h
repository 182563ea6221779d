// A part of a longer piece of work: its progress moves a range of the whole's.
#pragma once

#include <string>
#include <string_view>

#include "metaball/control.h"

namespace sherd {

// Progress of the returned control runs from `from` to `to`; `prefix` goes before what it says.
// `whole` must outlive it.
inline Control PartOf(const Control& whole, double from, double to, std::string prefix = "") {
  Control part;
  part.stop = whole.stop;
  if (whole.progress) {
    part.progress = [&whole, from, to, prefix = std::move(prefix)](std::string_view what,
                                                                   double fraction) {
      whole.progress(prefix + std::string(what), from + (to - from) * fraction);
    };
  }
  return part;
}

}  // namespace sherd
