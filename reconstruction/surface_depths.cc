#include "reconstruction/surface_depths.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/parallel.h"
#include "reconstruction/photographs.h"

namespace sherd {
namespace {

// The maps reach beyond the pinhole's picture by this share of it on each side: distorted
// originals show more than their pinhole camera.
constexpr double kMargin = 0.08;
constexpr double kJumpSpacings = 6.0;
constexpr double kJumpOfDistance = 0.01;

}  // namespace

SurfaceDepths::SurfaceDepths(const Survey& survey, const Level& level, const Surface& surface,
                             std::size_t max_bytes)
    : survey_(survey),
      surface_(surface),
      jump_(kJumpSpacings * level.stats.spacing),
      planes_(survey.photographs.size()),
      sights_(survey.photographs.size()) {
  const double pixels = static_cast<double>(max_bytes) / (sizeof(float) + 1) /
                        static_cast<double>(std::max<std::size_t>(1, planes_.size()));
  side_ = static_cast<int>(std::clamp(std::sqrt(pixels), 64.0, double{kLargestSide}));
}

Camera SurfaceDepths::CameraOf(std::size_t photo) const {
  Camera camera = CameraOfPhotograph(survey_, photo);
  const double scale =
      side_ / (1 + 2 * kMargin) / static_cast<double>(std::max(camera.width, camera.height));
  const int width = std::max(1, static_cast<int>(std::lround(camera.width * scale)));
  const int height = std::max(1, static_cast<int>(std::lround(camera.height * scale)));
  camera = camera.Resized(width, height);
  const int margin = static_cast<int>(std::lround(kMargin * std::max(width, height)));
  return camera.Cropped(-margin, -margin, width + 2 * margin, height + 2 * margin);
}

void SurfaceDepths::Render(const Scene& scene, std::size_t photo, Renderer* renderer,
                           const Control& control) {
  RenderSettings settings;
  settings.planes.depth = true;
  const Camera camera = CameraOf(photo);
  Frame frame = renderer->Render(scene, camera, settings, {{}, control.stop});
  const std::vector<float>& depth = frame.depth;
  const int width = camera.width, height = camera.height;
  std::vector<std::uint8_t> inside(depth.size());
  ParallelBlocks(static_cast<std::size_t>(height), 16, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width + x;
        const float here = depth[i];
        const double jump = jump_ + kJumpOfDistance * here;
        int nearest = 3;  // chessboard distance to the next jump
        for (int dy = -2; dy <= 2; ++dy) {
          for (int dx = -2; dx <= 2; ++dx) {
            const int u = std::clamp(x + dx, 0, width - 1), v = std::clamp(y + dy, 0, height - 1);
            const float there = depth[static_cast<std::size_t>(v) * width + u];
            // A slope is no jump: what counts is measured per pixel of the way.
            const int way = std::max(std::abs(dx), std::abs(dy));
            if ((here > 0) != (there > 0) || std::abs(there - here) > jump * std::max(1, way)) {
              nearest = std::min(nearest, std::max(1, way));
            }
          }
        }
        inside[i] = static_cast<std::uint8_t>((nearest - 1) * 255 / 2);
      }
    }
  });
  Planes& planes = planes_[photo];
  planes = {std::move(frame.depth), std::move(inside)};
  sights_[photo] = {camera, planes.depth.data(), planes.inside.data()};
}

void SurfaceDepths::Prepare(const std::shared_ptr<const Level>& level,
                            const std::vector<bool>& photos, Renderer* renderer,
                            const Control& control) {
  Scene scene;
  scene.cloud = std::shared_ptr<const Cloud>(level, &level->cloud);
  scene.surface = surface_;
  scene.lighting.unlit = true;
  std::size_t missing = 0, done = 0;
  for (std::size_t i = 0; i < sights_.size(); ++i) missing += photos[i] && !sights_[i].depth;
  for (std::size_t i = 0; i < sights_.size(); ++i) {
    if (!photos[i] || sights_[i].depth) continue;
    control.ThrowIfStopped();
    control.Report("finding what each photograph sees",
                   static_cast<double>(done++) / static_cast<double>(missing));
    Render(scene, i, renderer, control);
  }
}

std::size_t SurfaceDepths::MemoryBytes() const {
  std::size_t bytes = 0;
  for (const Planes& planes : planes_) bytes += planes.depth.size() * (sizeof(float) + 1);
  return bytes;
}

}  // namespace sherd
