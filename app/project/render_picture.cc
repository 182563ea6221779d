#include "app/project/render_picture.h"

#include <algorithm>

#include "cuda/renderers.h"
#include "metaball/appearance/deferred.h"
#include "metaball/error.h"
#include "metaball/progress_range.h"
#include "metaball/supersample.h"

namespace sherd {

PhotographShader MakePhotographShader(const Survey& survey, Renderer* renderer,
                                      const PhotoShadingOptions& options) {
  PhotographShader shader(survey, options);
  shader.ShadeOn(MakePhotoShader(*renderer));
  shader.DrawWith(renderer);
  return shader;
}

Frame PhotographRenderer::Render(const Scene& scene, const Camera& camera,
                                 const RenderSettings& settings, const Control& control) {
  if (scene.appearance.filter > 1) return RenderDeferred(this, scene, camera, settings, control);
  // Each of the finer picture's pixels looks into the photographs, then they are averaged.
  if (settings.supersample > 1) return RenderSupersampled(this, scene, camera, settings, control);
  Scene without_photos = scene;
  without_photos.appearance.color = ColorSource::kBlended;
  RenderSettings all = settings;
  all.planes.depth = all.planes.normal = all.planes.id = true;
  all.planes.light |= !scene.lighting.unlit;
  Frame frame = inner_->Render(without_photos, camera, all, PartOf(control, 0, 0.5));
  const PhotoShadingStats stats =
      shader_->Shade(level_, scene.surface, camera, &frame, PartOf(control, 0.5, 1));
  frame.stats.seconds_total += stats.seconds;
  frame.stats.seconds_prepare += stats.seconds_once;
  if (!settings.planes.depth) frame.depth = {};
  if (!settings.planes.normal) frame.normal = {};
  if (!settings.planes.id) frame.id = {};
  if (!settings.planes.light) frame.light = {};

  stats_.pixels += stats.pixels;
  stats_.from_photos += stats.from_photos;
  stats_.across_holes += stats.across_holes;
  stats_.without_photo += stats.without_photo;
  stats_.photos_used = std::max(stats_.photos_used, stats.photos_used);
  stats_.photos_unreadable = std::max(stats_.photos_unreadable, stats.photos_unreadable);
  stats_.seconds += stats.seconds;
  for (const std::string& warning : stats.warnings) {
    if (std::find(stats_.warnings.begin(), stats_.warnings.end(), warning) ==
        stats_.warnings.end()) {
      stats_.warnings.push_back(warning);
    }
  }
  return frame;
}

int StripRows(const Camera& camera, const Planes& planes, std::size_t max_bytes) {
  const std::size_t row =
      planes.BytesPerPixel() * static_cast<std::size_t>(std::max(1, camera.width));
  return static_cast<int>(std::clamp<std::size_t>(
      max_bytes / row, 1, static_cast<std::size_t>(std::max(1, camera.height))));
}

RenderStats RenderInStrips(Renderer* renderer, const Scene& scene, const Camera& camera,
                           const RenderSettings& settings,
                           const std::function<void(Frame&& strip)>& sink, const Control& control,
                           std::size_t max_bytes) {
  const int rows = StripRows(camera, PlanesNeeded(scene, settings.planes), max_bytes);
  RenderStats stats;
  for (int y = 0; y < camera.height; y += rows) {
    const int height = std::min(rows, camera.height - y);
    const Control part = PartOf(control, static_cast<double>(y) / camera.height,
                                static_cast<double>(y + height) / camera.height);
    const bool whole = height == camera.height;
    Frame strip = renderer->Render(
        scene, whole ? camera : camera.Cropped(0, y, camera.width, height), settings, part);
    stats += strip.stats;
    sink(std::move(strip));
  }
  return stats;
}

}  // namespace sherd
