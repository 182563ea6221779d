// The comparison sheet: one camera, several levels side by side, each with title and figures, and a
// scale bar when the scale is known. Text and lines are drawn by cairo.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/frame.h"
#include "reconstruction/level.h"

namespace sherd {

struct SheetPanel {
  std::string title;  // "63k"
  LevelStats level;
  double threshold = 0.7, radius_scale = 1.0;
  Frame frame;  // composited on the background
};

struct SheetOptions {
  int width = 1920, height = 1080;  // of the whole sheet, pixels
  std::string title;                // the project's name
  std::string subtitle;             // the view, date, source
  std::optional<double> metres_per_unit;
};

// The size each panel's frame must have for a sheet of n panels. Throws Error when the sheet is too
// small to hold them legibly, naming the smallest size that is large enough.
struct PanelSize {
  int width = 0, height = 0, columns = 0, rows = 0;
};
PanelSize PanelSizeFor(const SheetOptions& options, int panels);

// Draws the sheet as a frame (opaque, linear light) ready for WritePicture.
Frame ComposeSheet(const SheetOptions& options, const Camera& camera,
                   const std::vector<SheetPanel>& panels);

// One row a panel: name, count, spacing, radius, threshold, hits, times, memory. Atomic.
void WriteSheetCsv(const std::string& path, const std::vector<SheetPanel>& panels);

}  // namespace sherd
