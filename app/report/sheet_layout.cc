#include "app/report/sheet_layout.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "metaball/error.h"

namespace sherd {
namespace {

constexpr int kLargestSide = 32000;     // cairo's image surfaces end at 32767
constexpr double kSmallestUnit = 0.62;  // the smallest type is 12 units: 7.4 pixels
constexpr double kFigureWidth = 112;    // units a figure under a panel needs
constexpr double kSmallestPanel = 150;  // pixels, both sides

std::optional<SheetLayout> Grid(int width, int height, int panels, int columns) {
  SheetLayout s;
  s.unit = std::min(width / 1920.0, height / 1080.0);
  s.margin = 44 * s.unit;
  s.gap = 26 * s.unit;
  s.header = 84 * s.unit;
  s.footer = 62 * s.unit;
  s.columns = columns;
  s.rows = (panels + columns - 1) / columns;
  s.panel_width = static_cast<int>((width - 2 * s.margin - (columns - 1) * s.gap) / columns);
  s.figure_columns =
      std::clamp(static_cast<int>(s.panel_width / (kFigureWidth * s.unit)), 1, kSheetFigures);
  s.figure_rows = (kSheetFigures + s.figure_columns - 1) / s.figure_columns;
  // Even rows: 3 + 3 rather than 4 + 2.
  s.figure_columns = (kSheetFigures + s.figure_rows - 1) / s.figure_rows;
  s.caption = (44 + 44 * s.figure_rows) * s.unit;
  const double free = height - 2 * s.margin - s.header - s.footer - (s.rows - 1) * s.gap;
  s.panel_height = static_cast<int>(free / s.rows - s.caption);
  if (s.unit < kSmallestUnit || s.panel_width < kSmallestPanel || s.panel_height < kSmallestPanel ||
      s.panel_width < 2 * kFigureWidth * s.unit) {
    return std::nullopt;
  }
  return s;
}

std::optional<SheetLayout> BestGrid(int width, int height, int panels, double subject_aspect) {
  const double aspect = std::clamp(subject_aspect, 0.2, 5.0);
  std::optional<SheetLayout> best;
  double best_area = 0;
  for (int columns = 1; columns <= panels; ++columns) {
    const std::optional<SheetLayout> s = Grid(width, height, panels, columns);
    if (!s) continue;
    // How large the subject appears. Levels are compared best side by side: at about the same size
    // the wider grid wins. Empty places in the last row look like something missing: they must buy
    // a subject half as large again.
    const double w = std::min<double>(s->panel_width, s->panel_height * aspect);
    const bool full = s->columns * s->rows == panels;
    const double area = w * w / aspect * (1 + 0.08 * columns / panels) * (full ? 1.5 : 1.0);
    if (area > best_area) {
      best_area = area;
      best = s;
    }
  }
  return best;
}

}  // namespace

int SheetLayout::PanelX(int panel) const {
  return static_cast<int>(margin + (panel % columns) * (panel_width + gap));
}

int SheetLayout::PanelY(int panel) const {
  return static_cast<int>(margin + header + (panel / columns) * (panel_height + caption + gap));
}

SheetLayout LayOutSheet(int width, int height, int panels, double subject_aspect) {
  if (panels < 1) throw Error("a sheet needs at least one panel");
  if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide) {
    throw Error("a sheet is between 1 and " + std::to_string(kLargestSide) + " pixels on a side");
  }
  if (const std::optional<SheetLayout> s = BestGrid(width, height, panels, subject_aspect))
    return *s;
  for (double scale = 1.02; scale < 1000; scale *= 1.02) {
    // To the next ten pixels.
    const int w = static_cast<int>(std::ceil(width * scale / 10)) * 10;
    const int h = static_cast<int>(std::ceil(height * scale / 10)) * 10;
    if (w > kLargestSide || h > kLargestSide) break;
    if (BestGrid(w, h, panels, subject_aspect)) {
      throw Error("a sheet of " + std::to_string(width) + "x" + std::to_string(height) +
                  " pixels is too small for " + std::to_string(panels) +
                  (panels == 1 ? " level" : " levels") + "; " + std::to_string(w) + "x" +
                  std::to_string(h) + " is large enough");
    }
  }
  throw Error("no sheet of the shape " + std::to_string(width) + "x" + std::to_string(height) +
              " holds " + std::to_string(panels) + (panels == 1 ? " level" : " levels") +
              "; take fewer levels or another shape");
}

PanelSize PanelSizeFor(const SheetOptions& options, int panels) {
  const SheetLayout s = LayOutSheet(options.width, options.height, panels, options.subject_aspect);
  return {s.panel_width, s.panel_height, s.columns, s.rows};
}

}  // namespace sherd
