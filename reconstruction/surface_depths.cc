#include "reconstruction/surface_depths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

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
      renderer_(MakeCpuRenderer()),
      maps_(survey.photographs.size()) {
  const double pixels = static_cast<double>(max_bytes) / (sizeof(float) + 1) /
                        static_cast<double>(std::max<std::size_t>(1, maps_.size()));
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

void SurfaceDepths::Render(const Level& level, std::size_t photo, const Control& control) {
  Scene scene;
  scene.cloud = std::shared_ptr<const Cloud>(std::shared_ptr<void>(), &level.cloud);
  scene.surface = surface_;
  scene.lighting.unlit = true;
  RenderSettings settings;
  settings.planes.depth = true;
  auto map = std::make_unique<Map>();
  map->camera = CameraOf(photo);
  Frame frame = renderer_->Render(scene, map->camera, settings, {{}, control.stop});
  map->depth = std::move(frame.depth);
  const int width = map->camera.width, height = map->camera.height;
  map->inside.assign(map->depth.size(), 255);
  ParallelBlocks(static_cast<std::size_t>(height), 16, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width + x;
        const float here = map->depth[i];
        const double jump = jump_ + kJumpOfDistance * here;
        int nearest = 3;  // chessboard distance to the next jump
        for (int dy = -2; dy <= 2; ++dy) {
          for (int dx = -2; dx <= 2; ++dx) {
            const int u = std::clamp(x + dx, 0, width - 1), v = std::clamp(y + dy, 0, height - 1);
            const float there = map->depth[static_cast<std::size_t>(v) * width + u];
            // A slope is no jump: what counts is measured per pixel of the way.
            const int way = std::max(std::abs(dx), std::abs(dy));
            if ((here > 0) != (there > 0) || std::abs(there - here) > jump * std::max(1, way)) {
              nearest = std::min(nearest, std::max(1, way));
            }
          }
        }
        map->inside[i] = static_cast<std::uint8_t>((nearest - 1) * 255 / 2);
      }
    }
  });
  maps_[photo] = std::move(map);
}

void SurfaceDepths::Prepare(const Level& level, const std::vector<bool>& photos,
                            const Control& control) {
  std::size_t missing = 0, done = 0;
  for (std::size_t i = 0; i < maps_.size(); ++i) missing += photos[i] && !maps_[i];
  for (std::size_t i = 0; i < maps_.size(); ++i) {
    if (!photos[i] || maps_[i]) continue;
    control.ThrowIfStopped();
    control.Report("finding what each photograph sees",
                   static_cast<double>(done++) / static_cast<double>(missing));
    Render(level, i, control);
  }
}

PhotoSight SurfaceDepths::At(std::size_t photo, const Vec3d& point, const Vec3f& normal,
                             double tolerance) const {
  PhotoSight sight;
  const Map* const map = maps_[photo].get();
  if (!map) return sight;
  const Camera& camera = map->camera;
  double x = 0, y = 0;
  if (!camera.Project(point, &x, &y)) return sight;
  x -= 0.5;
  y -= 0.5;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= camera.width || y0 + 1 >= camera.height) return sight;
  const Vec3d way = point - camera.eye;
  const double distance = Length(way);
  // The surface's own slope over a pixel of the map.
  const double cosine = std::max(0.15, -Dot(way, normal.cast<double>()) / distance);
  const double pixel = camera.PixelSizeAt(Dot(way, camera.forward));
  const double limit = distance - tolerance - pixel * std::sqrt(1 / (cosine * cosine) - 1);
  const double fx = x - x0, fy = y - y0;
  const auto blend = [&](int dx, int dy) {
    const double weight = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy);
    const std::size_t i = static_cast<std::size_t>(y0 + dy) * camera.width + x0 + dx;
    if (map->depth[i] == 0 || map->depth[i] > limit) sight.visible += static_cast<float>(weight);
    sight.inside += static_cast<float>(weight) * static_cast<float>(map->inside[i]) / 255;
  };
  blend(0, 0);
  blend(1, 0);
  blend(0, 1);
  blend(1, 1);
  return sight;
}

std::uint64_t SurfaceDepths::KeyOf(const Level& level, const Surface& surface) {
  std::uint64_t hash = 0xcbf29ce484222325ull;
  const auto add = [&](const void* data, std::size_t bytes) {
    const auto* p = static_cast<const unsigned char*>(data);
    for (; bytes >= 8; bytes -= 8, p += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, p, 8);
      hash = (hash ^ word) * 0x100000001b3ull;
      hash ^= hash >> 29;
    }
    for (; bytes > 0; --bytes, ++p) hash = (hash ^ *p) * 0x100000001b3ull;
  };
  const Cloud& cloud = level.cloud;
  add(cloud.center.data(), cloud.center.size() * sizeof(Vec3f));
  add(cloud.radius.data(), cloud.radius.size() * sizeof(float));
  add(cloud.threshold.data(), cloud.threshold.size() * sizeof(float));
  const std::array<double, 9> numbers = {cloud.frame.origin.x,
                                         cloud.frame.origin.y,
                                         cloud.frame.origin.z,
                                         cloud.frame.unit,
                                         cloud.uniform_radius,
                                         surface.threshold,
                                         surface.radius_scale,
                                         static_cast<double>(surface.mode),
                                         static_cast<double>(cloud.size())};
  add(numbers.data(), sizeof(numbers));
  const std::string density = TextOf(surface.density);
  add(density.data(), density.size());
  return hash;
}

std::size_t SurfaceDepths::MemoryBytes() const {
  std::size_t bytes = 0;
  for (const auto& map : maps_) {
    if (map) bytes += map->depth.size() * (sizeof(float) + 1);
  }
  return bytes;
}

}  // namespace sherd
