// A run of measurements as tables: everything for files, the main figures for a screen.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "app/bench/figure_table.h"
#include "app/bench/measure.h"

namespace sherd {

// What was measured, for headers and titles.
struct BenchScene {
  std::string name;  // "height-field", "shell" or a file's name
  std::uint64_t metaballs = 0;
  int width = 0, height = 0;
  std::string density;
  double threshold = 0;
  std::string thresholds;  // "uniform", "blended", ... (ThresholdMode)
  int threads = 0, repeat = 0;
  std::string device;  // of the CPU, and of the GPU where it takes part
  double load = 0;     // the machine's load average over the last minute, before the run
};

// The load average over the last minute; negative where the system does not say.
double LoadAverage();

FigureTable FiguresOf(const std::vector<Measurement>& measurements);
std::vector<std::pair<std::string, Figure>> HeaderOf(const BenchScene& scene);
// The first row are the names of the columns. A method that cannot draw the scene is left out here
// and listed by ErrorsOf.
std::vector<std::vector<std::string>> ScreenTable(const std::vector<Measurement>& measurements);
// "polynomial: why", a line each; empty where everything was drawn.
std::string ErrorsOf(const std::vector<Measurement>& measurements);

}  // namespace sherd
