#include "app/desktop/export.h"

#include <QImage>
#include <QPainter>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "app/desktop/overlay.h"
#include "app/project/format.h"
#include "app/project/render_picture.h"
#include "app/report/sheet.h"
#include "metaball/color.h"
#include "metaball/error.h"
#include "metaball/progress_range.h"

namespace sherd {
namespace {

// Rays in one band: a fraction of a second on a CPU, and some 300 MB of planes at most.
constexpr std::uint64_t kBandRays = 2'000'000;

// The scale bar of a whole picture, to be laid over its bands as they come.
class ScaleBarLayer {
 public:
  ScaleBarLayer(const Camera& camera, double depth, double metres_per_unit) {
    const double unit = std::max(1.0, std::min(camera.width, camera.height) / 600.0);
    const auto bar =
        MakeScaleBar(camera, depth, metres_per_unit, longestScaleBar(camera.width, unit));
    if (!bar) return;
    const int width = std::min(camera.width, static_cast<int>(std::ceil(320 * unit)) + 1);
    const int height = std::min(camera.height, static_cast<int>(std::ceil(70 * unit)) + 1);
    top_ = camera.height - height;
    image_ = QImage(width, height, QImage::Format_ARGB32);
    image_.fill(Qt::transparent);
    QPainter painter(&image_);
    drawScaleBar(&painter, QRectF(0, 0, width, height), *bar, unit, 1.0,
                 camera.projection == Projection::kPerspective);
  }

  // `band` begins at row y0 of the picture.
  void Blend(int y0, Frame* band) const {
    for (int y = std::max(y0, top_); y < y0 + band->height && !image_.isNull(); ++y) {
      const auto* line = reinterpret_cast<const QRgb*>(image_.constScanLine(y - top_));
      Pixel* row = band->color.data() + static_cast<std::size_t>(y - y0) * band->width;
      for (int x = 0; x < image_.width(); ++x) {
        const float a = static_cast<float>(qAlpha(line[x])) / 255.0f;
        if (a <= 0) continue;
        const Vec3f c = LinearFromRgb8({static_cast<std::uint8_t>(qRed(line[x])),
                                        static_cast<std::uint8_t>(qGreen(line[x])),
                                        static_cast<std::uint8_t>(qBlue(line[x]))});
        Pixel& p = row[x];
        p = {c.x * a + p.r * (1 - a), c.y * a + p.g * (1 - a), c.z * a + p.b * (1 - a),
             a + p.a * (1 - a)};
      }
    }
  }

 private:
  int top_ = 0;
  QImage image_;
};

std::map<std::string, std::string> MetadataOf(const ExportScene& scene, const ExportView& view,
                                              const std::string& device) {
  const LevelEntry& level = scene.document->levels()[view.level_idx];
  return {{"Software", "Sherd"},
          {"sherd:source", scene.document->title()},
          {"sherd:level", level.name},
          {"sherd:metaballs", std::to_string(level.stats.count)},
          {"sherd:threshold", FormatExact(view.surface.threshold)},
          {"sherd:radius_scale", FormatExact(view.surface.radius_scale)},
          {"sherd:colors", view.photograph_colors ? "photographs" : "blended"},
          {"sherd:device", device}};
}

// Null without a survey, which must outlive it as the renderer must.
std::unique_ptr<PhotographShader> ShaderOf(Renderer* renderer, const Survey* survey) {
  if (!survey) return nullptr;
  return std::make_unique<PhotographShader>(MakePhotographShader(*survey, renderer));
}

}  // namespace

RenderStats RenderInBands(const PictureJob& job, const Camera& camera, int supersample,
                          const std::function<void(int y0, Frame band)>& take,
                          const Control& control) {
  const int n = std::max(1, supersample);
  const Scene scene{job.cloud(), job.surface, job.lighting};
  RenderSettings settings;
  settings.supersample = n;
  Renderer* renderer = job.renderer;
  std::optional<PhotographRenderer> photographs;
  if (job.photographs) {
    renderer = &photographs.emplace(job.renderer, job.photographs, job.level);
  }

  RenderStats stats;
  const std::uint64_t rays_per_row = static_cast<std::uint64_t>(camera.width) * n * n;
  const int rows =
      static_cast<int>(std::clamp<std::uint64_t>(kBandRays / rays_per_row, 1, camera.height));
  for (int y0 = 0; y0 < camera.height; y0 += rows) {
    control.ThrowIfStopped();
    const int height = std::min(rows, camera.height - y0);
    const Control part = PartOf(control, static_cast<double>(y0) / camera.height,
                                static_cast<double>(y0 + height) / camera.height);
    Frame band =
        renderer->Render(scene, camera.Cropped(0, y0, camera.width, height), settings, part);
    stats += band.stats;
    take(y0, std::move(band));
    part.Report("Rendering", 1.0);
  }
  return stats;
}

void ExportScreenshot(const ExportScene& scene, const ExportView& view,
                      const PictureExport& options, const Control& control) {
  control.Report("Loading the level", 0.0);
  PictureJob job;
  job.level = scene.document->LoadLevel(view.level_idx, control);
  job.surface = view.surface;
  job.lighting = scene.lighting;
  const std::unique_ptr<Renderer> renderer =
      rendererOrAutomatic(scene.factory, scene.device, nullptr);
  job.renderer = renderer.get();
  std::shared_ptr<const Survey> survey;
  std::unique_ptr<PhotographShader> photographs;
  if (view.photograph_colors) {
    survey = scene.document->LoadSurvey(control);
    photographs = ShaderOf(renderer.get(), survey.get());
  }
  job.photographs = photographs.get();

  const Camera camera = Letterboxed(scene.camera, options.width, options.height);
  PictureOptions picture;
  picture.alpha = options.background.transparent;
  picture.bits = options.bits;
  picture.metadata = MetadataOf(scene, view, renderer->device());
  PictureWriter writer(options.path, options.width, options.height, picture);
  std::optional<ScaleBarLayer> bar;
  if (options.scale_bar && scene.document->metres_per_unit()) {
    bar.emplace(camera, scene.target_depth, *scene.document->metres_per_unit());
  }
  RenderInBands(
      job, camera, options.supersample,
      [&](int y0, Frame band) {
        Composite(options.background, &band);
        if (bar) bar->Blend(y0, &band);
        writer.WriteRows(band);
      },
      PartOf(control, 0.02, 0.98));
  control.ThrowIfStopped();
  writer.Finish();
  control.Report("Done", 1.0);
}

void ExportSheet(const ExportScene& scene, const std::vector<ExportView>& views,
                 const PictureExport& options, const Control& control) {
  if (views.empty()) throw Error("a comparison sheet needs at least one level");
  SheetOptions sheet;
  sheet.width = options.width;
  sheet.height = options.height;
  sheet.title = options.title;
  sheet.subtitle = options.subtitle;
  sheet.metres_per_unit = scene.document->metres_per_unit();
  // As in the window.
  sheet.scale_depth = scene.target_depth;
  const PanelSize size = PanelSizeFor(sheet, static_cast<int>(views.size()));
  const Camera camera = Letterboxed(scene.camera, size.width, size.height);
  const std::unique_ptr<Renderer> renderer =
      rendererOrAutomatic(scene.factory, scene.device, nullptr);
  std::shared_ptr<const Survey> survey;
  std::unique_ptr<PhotographShader> photographs;
  if (std::any_of(views.begin(), views.end(),
                  [](const ExportView& view) { return view.photograph_colors; })) {
    control.Report("Finding the photographs", 0.0);
    survey = scene.document->LoadSurvey(control);
    photographs = ShaderOf(renderer.get(), survey.get());
  }

  std::vector<SheetPanel> panels;
  const double share = 0.9 / static_cast<double>(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ExportView& view = views[i];
    const LevelEntry& entry = scene.document->levels().at(view.level_idx);
    const Control part = PartOf(control, share * static_cast<double>(i),
                                share * static_cast<double>(i + 1), entry.name + ": ");
    PictureJob job;
    job.renderer = renderer.get();
    job.level = scene.document->LoadLevel(view.level_idx, PartOf(part, 0.0, 0.2));
    job.surface = view.surface;
    job.lighting = scene.lighting;
    if (view.photograph_colors) job.photographs = photographs.get();
    SheetPanel panel;
    panel.title = entry.name;
    panel.level = entry.stats;
    panel.threshold = view.surface.threshold;
    panel.radius_scale = view.surface.radius_scale;
    panel.frame.width = size.width;
    panel.frame.height = size.height;
    panel.frame.color.reserve(static_cast<std::size_t>(size.width) * size.height);
    panel.frame.stats = RenderInBands(
        job, camera, options.supersample,
        [&panel](int, Frame band) {
          panel.frame.color.insert(panel.frame.color.end(), band.color.begin(), band.color.end());
        },
        PartOf(part, 0.2, 1.0));
    Composite(options.background, &panel.frame);
    panels.push_back(std::move(panel));
  }
  control.ThrowIfStopped();
  control.Report("Writing the sheet", 0.92);
  PictureOptions picture;
  picture.bits = options.bits;
  picture.metadata = {{"Software", "Sherd"}, {"sherd:source", scene.document->title()}};
  WritePicture(options.path, ComposeSheet(sheet, camera, panels), picture);
  namespace fs = std::filesystem;
  const fs::path path(options.path);
  if (options.csv) {
    WriteSheetCsv(fs::path(path).replace_extension(".csv").string(), panels, sheet.metres_per_unit);
  }
  for (std::size_t i = 0; options.separate && i < panels.size(); ++i) {
    picture.metadata = MetadataOf(scene, views[i], panels[i].frame.stats.device);
    fs::path one = path;
    one.replace_filename(path.stem().string() + "-" + panels[i].title + path.extension().string());
    WritePicture(one.string(), panels[i].frame, picture);
  }
  control.Report("Done", 1.0);
}

}  // namespace sherd
