// One colour for each metaball, taken from the photographs' full resolution.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"

namespace sherd {

struct PhotoColorOptions {
  int memory_mb = 1024;                  // bounds the photographs' pixels and the samples
  std::vector<std::uint32_t> leave_out;  // photographs that are not used; any order
  bool even_exposures = true;
};

struct PhotoColorStats {
  std::uint64_t metaballs = 0;
  std::uint64_t colored = 0;  // from at least one photograph; the others keep their colour
  std::uint64_t samples = 0;
  std::uint64_t photos_used = 0;
  std::uint64_t photos_unreadable = 0;
  double seconds = 0;
  std::vector<std::string> warnings;
};

// Gives every metaball of the level the colour that the photographs it lists show at its place:
// each is averaged in linear light over a square as wide as the metaballs are apart, exposures
// evened out; photographs that see the place squarely and finely count more, and those that
// contradict the weighted median of all (highlights, passers-by) hardly. Deterministic. Throws
// InputError where the level lists no photographs, Cancelled.
PhotoColorStats ColorFromPhotographs(const Survey& survey, const PhotoColorOptions& options,
                                     Level* level, const Control& control = {});

}  // namespace sherd
