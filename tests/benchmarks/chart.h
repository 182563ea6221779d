// The chart of the thesis's figure 4.7: rows of capitals that grow smaller.
#pragma once

#include <string>
#include <vector>

namespace sherd::benchmarks {

inline constexpr int kChartSide = 2000;  // pixels
inline constexpr int kChartRows = 22;    // letter heights 120 down to 10 px

struct ChartRow {
  std::string text;
  double height_px = 0;                               // of a capital H
  double left_px = 0, baseline_px = 0, width_px = 0;  // from the upper left corner
};

struct Chart {
  std::vector<ChartRow> rows;
  std::vector<unsigned char> ink;  // 255: black; kChartSide^2, row-major

  Chart();  // DejaVu Sans Bold. Throws Error where cairo cannot draw.

  // The luma, sRGB-encoded, at (x, y) pixels of the chart over a square of `footprint` pixels;
  // white outside.
  float Gray(double x, double y, double footprint) const;

 private:
  std::vector<double> sums_;  // of ink over the upper left rectangle
  double SumAt(double x, double y) const;
};

}  // namespace sherd::benchmarks
