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
  // Perspective: the distance along the camera's axis at which the scale bar holds, world units.
  // Default: that of the surface in the middle of the picture, from the panels' depth planes.
  std::optional<double> scale_depth;
  // Width over height of what is to be seen: the grid is chosen to show that largest.
  double subject_aspect = 1.3;
};

// The size each panel's frame must have for a sheet of n panels. Throws Error when the sheet is too
// small to hold them legibly, naming a size of the same shape that is large enough, or larger than
// 32000 pixels on a side.
struct PanelSize {
  int width = 0, height = 0, columns = 0, rows = 0;
};
PanelSize PanelSizeFor(const SheetOptions& options, int panels);

// Draws the sheet as a frame (opaque, linear light) ready for WritePicture. Frames are drawn pixel
// for pixel: each must have the size PanelSizeFor gives. `camera` has that size too.
Frame ComposeSheet(const SheetOptions& options, const Camera& camera,
                   const std::vector<SheetPanel>& panels);

// One row a panel: name, counts, spacing, radii, threshold, hits, rare events, times, memory.
// Lengths are in world units; with a scale, columns in metres follow them. Comma-separated, first
// row the names, UTF-8, decimal point. Atomic; throws OutputError.
void WriteSheetCsv(const std::string& path, const std::vector<SheetPanel>& panels,
                   const std::optional<double>& metres_per_unit = {});

}  // namespace sherd
