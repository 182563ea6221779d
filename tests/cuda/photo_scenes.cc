#include "photo_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "metaball/appearance/light_view.h"
#include "metaball/parallel.h"
#include "metaball/photo/filter.h"
#include "metaball/photo/photo_blend.h"
#include "metaball/photo/photo_choice.h"
#include "metaball/photo/viewed_point.h"
#include "metaball/renderer.h"

namespace sherd {
namespace {

// Wellons' lowbias32: one that a line can hold.
std::uint32_t Hash(std::uint32_t x) {
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  return x ^ x >> 16;
}
double Uniform(std::uint32_t i) { return Hash(i) / 4294967296.0; }

constexpr double kFocal = 0.9;  // in widths of the photograph

// Above (x, z), looking down: right is world x, down is world z.
PhotoCamera CameraAbove(const Vec3d& center, int width, int height) {
  PhotoCamera camera;
  camera.usable = true;
  camera.qw = std::sqrt(0.5);
  camera.qx = -std::sqrt(0.5);
  camera.center = center;
  camera.translation = {-center.x, -center.z, center.y};
  Lens lens;
  lens.model = CameraModelId::kSimpleRadial;
  lens.fx = lens.fy = kFocal * width;
  lens.cx = 0.5 * width;
  lens.cy = 0.5 * height;
  lens.k[0] = -0.1;
  lens.distorts = true;
  lens.radius_limit = 1.5;
  camera.lens = camera.original = lens;
  camera.width = width;
  camera.height = height;
  camera.original_width = width;
  camera.original_height = height;
  return camera;
}

Camera MapCameraAbove(const Vec3d& center) {
  Camera camera;
  camera.width = 200;
  camera.height = 160;
  camera.eye = center;
  camera.right = {1, 0, 0};
  camera.down = {0, 0, 1};
  camera.forward = {0, -1, 0};
  camera.fx = camera.fy = 0.8 * kFocal * camera.width;
  camera.cx = 0.5 * camera.width;
  camera.cy = 0.5 * camera.height;
  return camera;
}

}  // namespace

PhotoPyramid MakeNoisePhoto(int width, int height, int finest, std::uint32_t seed) {
  std::vector<PhotoLevel> levels;
  const std::vector<LevelSize> sizes = LevelSizes(width, height);
  for (auto k = static_cast<std::size_t>(finest); k < sizes.size(); ++k) {
    PhotoLevel noise{sizes[k].width, sizes[k].height, {}};
    const auto count = static_cast<std::uint32_t>(noise.width) * noise.height;
    noise.pixels.reserve(count);
    const std::uint32_t start = Hash(seed * 32 + static_cast<std::uint32_t>(k));
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t bits = Hash(start + i);
      noise.pixels.push_back({static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8),
                              static_cast<std::uint8_t>(bits >> 16)});
    }
    levels.push_back(std::move(noise));
  }
  return {width, height, finest, std::move(levels)};
}

PhotoField::PhotoField(const PhotoFieldOptions& options)
    : PhotoField(options, MakeHeightField(options.metaballs, options.width, options.height)) {}

PhotoField::PhotoField(const PhotoFieldOptions& options, PeerScene field)
    : scene_(std::move(field.scene)),
      camera_(field.camera),
      index_(*scene_.cloud, 0.0f, SheetView::kWidening) {
  const Cloud& cloud = *scene_.cloud;
  const auto photos = static_cast<std::uint32_t>(options.photos);
  photo_begin_.push_back(0);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3d p = cloud.frame.WorldFromLocal(cloud.center[i]);
    const bool away = options.holes && std::hypot(p.x - 0.5, p.z - 0.4) < 0.1;
    normal_.push_back({0, away ? -1.0f : 1.0f, 0});
    for (std::uint32_t photo = 0; photo < photos; ++photo) {
      if (Uniform(static_cast<std::uint32_t>(i) * photos + photo) < 0.5) {
        photo_idx_.push_back(static_cast<std::uint16_t>(photo));
      }
    }
    photo_begin_.push_back(static_cast<std::uint32_t>(photo_idx_.size()));
  }
  const auto renderer = MakeCpuRenderer();
  RenderSettings depth_alone;
  depth_alone.planes.depth = true;
  const int columns = static_cast<int>(std::ceil(std::sqrt(options.photos)));
  for (std::uint32_t photo = 0; photo < photos; ++photo) {
    const int row = static_cast<int>(photo) / columns, column = static_cast<int>(photo) % columns;
    const Vec3d center{(column + 0.5) / columns, 0.45 + 0.2 * Uniform(photo),
                       (row + 0.5) / columns};
    pyramids_.push_back(MakeNoisePhoto(options.photo_width, options.photo_height, 0, photo));
    cameras_.push_back(CameraAbove(center, options.photo_width, options.photo_height));
    const Camera map = MapCameraAbove(center);
    depths_.push_back(renderer->Render(scene_, map, depth_alone).depth);
    insides_.emplace_back(depths_.back().size(), static_cast<std::uint8_t>(255 - photo));
    sights_.push_back({map, nullptr, nullptr});
    const float gain = static_cast<float>(0.8 + 0.4 * Uniform(77 + photo));
    gains_.push_back({gain, 1.0f, 1 / gain});
    candidates_.push_back(photo);
  }
  for (std::uint32_t photo = 0; photo < photos; ++photo) {
    sights_[photo].depth = depths_[photo].data();
    sights_[photo].inside = insides_[photo].data();
  }
  masks_.resize(photos);
  MaskDistanceView& mask = masks_[photos / 2];
  mask.columns = 20;
  mask.rows = 15;
  mask.cells_per_px_x = mask.columns / static_cast<double>(options.photo_width);
  mask.cells_per_px_y = mask.rows / static_cast<double>(options.photo_height);
  mask.cell_px = 1 / mask.cells_per_px_x;
  for (int row = 0; row < mask.rows; ++row) {
    for (int column = 0; column < mask.columns; ++column) {
      const double cells = std::max(0.0, std::hypot(column - 12, row - 7) - 4);
      quarters_.push_back(static_cast<std::uint8_t>(std::min(255.0, 4 * cells)));
    }
  }
  mask.quarters = quarters_.data();

  SheetView& sheet = photo_scene_.sheet;
  sheet.frame = cloud.frame;
  sheet.count = static_cast<std::uint32_t>(cloud.size());
  sheet.center = cloud.center.data();
  sheet.radius = cloud.radius.empty() ? nullptr : cloud.radius.data();
  sheet.uniform_radius = cloud.uniform_radius;
  sheet.normal = normal_.data();
  sheet.photo_begin = photo_begin_.data();
  sheet.photo_idx = photo_idx_.data();
  sheet.index = index_.view();
  photo_scene_.sheet_key = photo_scene_.sight_key = 1;
  photo_scene_.camera = cameras_;
  photo_scene_.sight = sights_;
  photo_scene_.mask = masks_;
  photo_scene_.gain = gains_;
  photo_scene_.candidates = candidates_;
}

Frame PhotoField::Render() const {
  RenderSettings settings;
  settings.planes.depth = settings.planes.normal = settings.planes.id = true;
  settings.planes.light = true;
  return MakeCpuRenderer()->Render(scene_, camera_, settings);
}

void PhotoField::Fetch(std::span<const PhotoRequest> requests,
                       const std::function<void(std::size_t i, const PhotoPyramid* pyramid)>& visit,
                       const Control&) {
  for (std::size_t i = 0; i < requests.size(); ++i) {
    visit(i, &pyramids_[requests[i].photo]);
  }
}

void PhotoField::ShadePlainly(Frame* frame) const {
  const SheetView& sheet = photo_scene_.sheet;
  const PhotosView photos{cameras_.data(), sights_.data(), masks_.data(), candidates_.data(),
                          static_cast<std::uint32_t>(candidates_.size())};
  ParallelFor(frame->height, 0, [&](std::int64_t y, int) {
    for (int x = 0; x < frame->width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * frame->width + x;
      Pixel& pixel = frame->color[i];
      if (frame->id[i] < 0) continue;
      const ViewedPoint point = ViewPoint(
          camera_, sheet, {x, static_cast<int>(y), frame->depth[i], frame->normal[i], frame->id[i]},
          [](std::uint32_t, float) {});
      PhotoLookup lookups[kMostPhotos];
      const int n = ChoosePhotos(
          photos, point,
          [&](std::uint32_t photo) { return sheet.ShareOf(photo, point.hit, frame->id[i]); },
          lookups);
      if (n == 0) continue;
      float weight[kMostPhotos];
      PhotoColors colors[kMostPhotos];
      for (int k = 0; k < n; ++k) {
        const std::uint32_t photo = lookups[k].photo;
        weight[k] = lookups[k].weight;
        colors[k] = WithGain(SampleColors(pyramids_[photo], lookups[k]), gains_[photo]);
      }
      const Vec3f c = ColorInLight(BlendPhotos(weight, colors, n), frame->light[i]);
      pixel = {c.x * pixel.a, c.y * pixel.a, c.z * pixel.a, pixel.a};
    }
  });
}

}  // namespace sherd
