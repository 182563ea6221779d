// A pixel's hit made ready for choosing photographs, on the CPU and on the GPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "metaball/camera.h"
#include "metaball/hostdevice.h"
#include "metaball/photo/photo_choice.h"
#include "metaball/photo/sheet_view.h"
#include "metaball/vec.h"

namespace sherd {

// What a frame says of a pixel that hits the surface.
struct PixelHit {
  int x = 0, y = 0;
  float depth = 0;        // world units along the pixel's ray
  Vec3f normal{};         // of the field, unit
  std::int32_t id = 0;    // its strongest metaball, of the sheet's
  bool on_sheet = false;  // depth and normal are the sheet's already (back_face.h)
};

// also(i, weight): SheetView::PointAt.
template <class Also>
SHERD_HD ViewedPoint ViewPoint(const Camera& camera, const SheetView& sheet, const PixelHit& pixel,
                               const Also& also) {
  const double px = pixel.x + 0.5, py = pixel.y + 0.5;
  const RayD ray = RayThrough(camera, px, py);
  ViewedPoint point;
  point.to_viewer = -ray.direction;
  point.hit = ray.origin + ray.direction * static_cast<double>(pixel.depth);
  SheetPoint on_sheet{point.hit, pixel.normal};
  if (!pixel.on_sheet) {
    on_sheet = sheet.PointAt(point.hit, ray.direction, pixel.id, pixel.normal, also);
  }
  point.position = on_sheet.position;
  point.normal = on_sheet.normal;
  // Half a metaball: the depth maps were sampled elsewhere on the same bumps.
  point.tolerance = 0.5 * sheet.RadiusOf(static_cast<std::uint32_t>(pixel.id)) * sheet.frame.unit;
  // Where the rays of the neighbouring pixels meet the tangent plane.
  const Vec3d normal = point.normal.cast<double>();
  const double slope = Dot(ray.direction, normal);
  if (std::abs(slope) > 0.05) {
    const auto on_plane = [&](const RayD& r) {
      const double other = Dot(r.direction, normal);
      const double safe = std::abs(other) > 0.05 ? other : other < 0 ? -0.05 : 0.05;
      return r.origin + r.direction * (Dot(point.position - r.origin, normal) / safe);
    };
    point.side_x = on_plane(RayThrough(camera, px + 1, py)) - point.position;
    point.side_y = on_plane(RayThrough(camera, px, py + 1)) - point.position;
  } else {  // nearly along the surface: the pixel as it faces the viewer
    const double size =
        camera.PixelSizeAt(std::max(1e-12, Dot(point.position - camera.eye, camera.forward)));
    point.side_x = camera.right * size;
    point.side_y = camera.down * size;
  }
  return point;
}

}  // namespace sherd
