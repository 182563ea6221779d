#include "reconstruction/photo_candidates.h"

#include <algorithm>
#include <cstddef>

#include "metaball/photo/photo_choice.h"
#include "reconstruction/parallel.h"

namespace sherd {
namespace {

constexpr int kGridPixels = 24;
constexpr std::size_t kNearestAtPoint = 12;

// Appends the first photographs in whose picture the point lies, unmasked.
void AddNearest(const PhotosView& photos, const Vec3d& point, const Vec3f& normal,
                const Vec3d& to_viewer, std::vector<std::uint32_t>* out) {
  PhotoOrder order(photos, point, normal, to_viewer);
  PhotoOrder::Direction next;
  for (std::size_t found = 0; found < kNearestAtPoint && order.Next(&next);) {
    double x = 0, y = 0;
    if (!photos.camera[next.photo].Project(point, &x, &y)) continue;
    PhotoLookup pixel;
    pixel.photo = next.photo;
    if (!(photos.Unmasked(pixel, point) > 0)) continue;
    out->push_back(next.photo);
    ++found;
  }
}

}  // namespace

std::vector<std::uint32_t> PhotoCandidates(const PhotoSet& photos, const Camera& camera,
                                           const Frame& frame) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < photos.size(); ++i) {
    if (photos.View(i)) all.push_back(i);
  }
  if (all.size() <= kNearestAtPoint) return all;
  const PhotosView view = photos.ViewOf({}, all);
  const int columns = (frame.width + kGridPixels - 1) / kGridPixels;
  const int rows = (frame.height + kGridPixels - 1) / kGridPixels;
  std::vector<std::vector<std::uint32_t>> nearest(static_cast<std::size_t>(rows));
  ParallelBlocks(static_cast<std::size_t>(rows), 1, [&](std::size_t row, std::size_t) {
    for (int column = 0; column < columns; ++column) {
      // The first hit of the cell.
      bool found = false;
      for (int y = static_cast<int>(row) * kGridPixels;
           y < std::min<int>(frame.height, static_cast<int>(row + 1) * kGridPixels) && !found;
           ++y) {
        for (int x = column * kGridPixels;
             x < std::min(frame.width, (column + 1) * kGridPixels) && !found; ++x) {
          const std::size_t pixel = static_cast<std::size_t>(y) * frame.width + x;
          if (frame.id[pixel] < 0) continue;
          found = true;
          const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
          AddNearest(view, ray.origin + ray.direction * double(frame.depth[pixel]),
                     frame.normal[pixel], -ray.direction, &nearest[row]);
        }
      }
    }
  });
  std::vector<bool> needed(photos.size(), false);
  for (const auto& row : nearest) {
    for (const std::uint32_t photo : row) needed[photo] = true;
  }
  std::erase_if(all, [&](std::uint32_t photo) { return !needed[photo]; });
  return all;
}

}  // namespace sherd
