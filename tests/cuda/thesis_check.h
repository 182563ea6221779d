// The thesis's method by the CUDA kernel against the same method on the CPU.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "json_writer.h"
#include "scenes.h"

namespace sherd {

struct ThesisCheck {
  std::string scene, backend, precision;
  std::uint64_t drawn = 0;  // pixels that the CPU draws
  // Drawn by one alone, or farther from each other than a hundredth of the smallest radius.
  std::uint64_t elsewhere = 0;
  std::uint64_t color_off = 0;  // drawn at one place, off by more than 8/255 in a component
  std::uint64_t allowed = 0;    // of both together
  double seconds = 0;           // of the frame
  bool passed = false;
  std::string error;
};

// backend: "host-loop" or "cuda". Draws the scene in both precisions. The host loop's doubles must
// be the CPU's. The device fuses products and sums, and floats round: where a ray only just meets
// something it may take the next thing, so few pixels may differ. Scenes that floats cannot carry
// (metaball/precision.h) are drawn in doubles alone.
std::vector<ThesisCheck> CheckThesis(const CheckScene& scene, const std::string& backend);

void Print(const ThesisCheck& check);
void Write(const ThesisCheck& check, JsonWriter* json);

}  // namespace sherd
