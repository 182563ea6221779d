#include "tests/benchmarks/chart.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>

#include "metaball/error.h"

namespace sherd::benchmarks {
namespace {

constexpr double kMargin = 40;  // pixels

// Words a surveyor writes, without letters that are mistaken for digits.
constexpr const char* kWords[] = {"TRENCH", "LAYER",  "WALL",  "HEARTH", "SECTION", "FLOOR",
                                  "PLAN",   "DATUM",  "NORTH", "SHERD",  "CUT",     "FILL",
                                  "SAMPLE", "METRES", "SPIT",  "FIND"};

}  // namespace

Chart::Chart() {
  cairo_surface_t* const surface =
      cairo_image_surface_create(CAIRO_FORMAT_A8, kChartSide, kChartSide);
  cairo_t* const cairo = cairo_create(surface);
  cairo_select_font_face(cairo, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_BOLD);
  cairo_font_options_t* const font = cairo_font_options_create();
  cairo_font_options_set_antialias(font, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(font, CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(font, CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(cairo, font);
  cairo_font_options_destroy(font);
  const auto width_of = [&](const std::string& text) {
    cairo_text_extents_t extents;
    cairo_text_extents(cairo, text.c_str(), &extents);
    return extents.x_advance;
  };
  cairo_set_font_size(cairo, 1000);
  cairo_text_extents_t capital;
  cairo_text_extents(cairo, "H", &capital);
  double y = kMargin;
  std::size_t word = 0;
  for (int i = 0; i < kChartRows; ++i) {
    ChartRow row;
    row.height_px = 120.0 - 110.0 * i / (kChartRows - 1);
    cairo_set_font_size(cairo, 1000 * row.height_px / capital.height);
    for (int words = 0; words < 4; ++words) {
      const std::string longer =
          row.text + (row.text.empty() ? "" : " ") + kWords[(word + words) % std::size(kWords)];
      if (width_of(longer) > kChartSide - 2 * kMargin) break;
      row.text = longer;
    }
    word += 3;
    row.left_px = kMargin;
    row.baseline_px = y + row.height_px;
    row.width_px = width_of(row.text);
    y = row.baseline_px + 14;
    cairo_move_to(cairo, row.left_px, row.baseline_px);
    cairo_show_text(cairo, row.text.c_str());
    rows.push_back(std::move(row));
  }
  cairo_surface_flush(surface);
  const bool drawn = cairo_status(cairo) == CAIRO_STATUS_SUCCESS;
  const unsigned char* const data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  ink.resize(std::size_t{kChartSide} * kChartSide);
  for (int r = 0; drawn && r < kChartSide; ++r) {
    std::copy_n(data + static_cast<std::size_t>(r) * stride, kChartSide,
                ink.begin() + static_cast<std::ptrdiff_t>(r) * kChartSide);
  }
  cairo_destroy(cairo);
  cairo_surface_destroy(surface);
  if (!drawn || y > kChartSide) throw Error("the chart could not be drawn");
  constexpr std::size_t kWidth = kChartSide + 1;
  sums_.assign(kWidth * kWidth, 0);
  for (std::size_t r = 0; r < kChartSide; ++r) {
    double line = 0;
    for (std::size_t c = 0; c < kChartSide; ++c) {
      line += ink[r * kChartSide + c] / 255.0;
      sums_[(r + 1) * kWidth + c + 1] = sums_[r * kWidth + c + 1] + line;
    }
  }
}

double Chart::SumAt(double x, double y) const {
  constexpr int kWidth = kChartSide + 1;
  x = std::clamp(x, 0.0, double{kChartSide});
  y = std::clamp(y, 0.0, double{kChartSide});
  const int x0 = std::min(static_cast<int>(x), kChartSide - 1);
  const int y0 = std::min(static_cast<int>(y), kChartSide - 1);
  const double fx = x - x0, fy = y - y0;
  const double* const row = &sums_[static_cast<std::size_t>(y0) * kWidth + x0];
  return (row[0] * (1 - fx) + row[1] * fx) * (1 - fy) +
         (row[kWidth] * (1 - fx) + row[kWidth + 1] * fx) * fy;
}

float Chart::Gray(double x, double y, double footprint) const {
  const double h = footprint / 2;
  const double share =
      (SumAt(x + h, y + h) - SumAt(x - h, y + h) - SumAt(x + h, y - h) + SumAt(x - h, y - h)) /
      (footprint * footprint);
  return static_cast<float>(0.95 - 0.90 * std::clamp(share, 0.0, 1.0));
}

}  // namespace sherd::benchmarks
