// Where everything stands on a comparison sheet. All lengths in pixels of the sheet.
#pragma once

#include <vector>

#include "app/report/sheet.h"

namespace sherd {

// Figures under each panel (spacing, radius, ...).
inline constexpr int kSheetFigures = 8;

struct SheetLayout {
  double unit = 1;  // sizes of type and gaps, in pixels of a 1920 x 1080 sheet
  double margin = 0, gap = 0;
  double header = 0, footer = 0;  // heights, the margin excluded
  int columns = 1, rows = 1;
  int panel_width = 0, panel_height = 0;
  int figure_columns = 1, figure_rows = 1;  // of the caption
  double caption = 0;                       // height below a panel

  // Upper-left corner of a panel's picture.
  int PanelX(int panel) const;
  int PanelY(int panel) const;
};

// Throws Error as PanelSizeFor says.
SheetLayout LayOutSheet(int width, int height, int panels, double subject_aspect);

}  // namespace sherd
