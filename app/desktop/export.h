// Pictures at any size, independent of the window: the work behind the export dialogs. Runs off the
// interface thread, with a renderer of its own.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/desktop/camera_controller.h"
#include "app/desktop/document.h"
#include "app/desktop/render_queue.h"
#include "app/project/picture.h"

namespace sherd {

// One picture's content.
struct ExportView {
  std::size_t level_idx = 0;  // into the document's levels
  Surface surface;
  bool photograph_colors = false;
};

struct PictureExport {
  std::string path;
  int width = 1920, height = 1080;
  int supersample = 2;
  int bits = 8;
  Background background;
  bool scale_bar = false;  // screenshots; only with a known scale
  // Sheets:
  std::string title, subtitle;
  bool csv = false;       // the figures beside the sheet, PATH with .csv
  bool separate = false;  // each panel as a picture of its own, PATH-LEVEL.EXT
};

struct ExportScene {
  std::shared_ptr<Document> document;
  Camera camera;            // as in the window; shown whole at any size
  double target_depth = 0;  // along its axis: where a perspective scale bar holds
  Lighting lighting;
  DeviceChoice device;
  RendererFactory factory;
};

struct PictureJob {
  Renderer* renderer = nullptr;
  PhotographShader* photographs = nullptr;  // null: blended colours
  std::shared_ptr<const Level> level;
  Surface surface;
  Lighting lighting;

  std::shared_ptr<const Cloud> cloud() const { return {level, &level->cloud}; }
};

// Renders in bands from the top and hands each to `take`: memory stays bounded, progress is true
// and a cancel is quick. Returns the sums over all bands. Throws what Renderer::Render throws.
RenderStats RenderInBands(const PictureJob& job, const Camera& camera, int supersample,
                          const std::function<void(int y0, Frame band)>& take,
                          const Control& control);

// Writes one picture. Throws OutputError, ResourceError, Cancelled; then no file was made.
void ExportScreenshot(const ExportScene& scene, const ExportView& view,
                      const PictureExport& options, const Control& control);
// Writes the comparison sheet of `views` (at least one), seen by one camera.
void ExportSheet(const ExportScene& scene, const std::vector<ExportView>& views,
                 const PictureExport& options, const Control& control);

}  // namespace sherd
