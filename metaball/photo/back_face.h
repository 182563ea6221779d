// Pixels that show the surface from its back, through a hole into the inside, and where the surface
// would be that they should have shown: depth and normal of the pixels around that show a front,
// carried across by the pull-push of Gortler, Grzeszczuk, Szeliski and Cohen (1996, section 3.4.2).
// The formulas, on the CPU and on the GPU.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "metaball/camera.h"
#include "metaball/hostdevice.h"
#include "metaball/photo/sheet_view.h"
#include "metaball/vec.h"

namespace sherd {

// kRim: a front beside a back.
enum class Facing : std::uint8_t { kUnknown, kFront, kRim, kBack };

inline constexpr int kRimWidth = 2;  // pixels

// metaball_normal: of a pixel's strongest metaball; direction: of its ray, unit. Outlines, where
// the cosine may have either sign, are left alone.
SHERD_HD Facing FacingOf(const Vec3f& metaball_normal, const Vec3d& direction) {
  constexpr double kFromBehind = 0.1;
  const double cosine = Dot(metaball_normal.cast<double>(), direction);
  return cosine > kFromBehind ? Facing::kBack : cosine < 0 ? Facing::kFront : Facing::kUnknown;
}

// Weighted sums of depth and normal.
struct RimCell {
  float weight = 0, depth = 0;
  Vec3f normal{};

  SHERD_HD void Add(const RimCell& other, float share) {
    weight += share * other.weight;
    depth += share * other.depth;
    normal += other.normal * share;
  }
  // What is well known counts once.
  SHERD_HD void Saturate() {
    const float over = std::max(1.0f, weight);
    weight /= over;
    depth /= over;
    normal = normal / over;
  }
};

// What a pixel of a rim tells: where its ray meets the sheet. depth, id, normal: of its hit.
SHERD_HD RimCell RimOf(const SheetView& sheet, const RayD& ray, float depth, std::int32_t id,
                       const Vec3f& normal) {
  const SheetPoint point = sheet.PointAt(ray.origin + ray.direction * static_cast<double>(depth),
                                         ray.direction, id, normal, [](std::uint32_t, float) {});
  return {1, static_cast<float>(Dot(point.position - ray.origin, ray.direction)), point.normal};
}

// A picture of such cells, row-major.
struct RimLevel {
  RimCell* cell = nullptr;
  int width = 0, height = 0;

  SHERD_HD RimCell& At(int x, int y) const { return cell[static_cast<std::size_t>(y) * width + x]; }
  // At the pixel (x, y) of a picture twice as wide, bilinear.
  SHERD_HD RimCell Between(int x, int y) const {
    const int x0 = x / 2, x1 = std::clamp(x % 2 ? x0 + 1 : x0 - 1, 0, width - 1);
    const int y0 = y / 2, y1 = std::clamp(y % 2 ? y0 + 1 : y0 - 1, 0, height - 1);
    RimCell out;
    out.Add(At(x0, y0), 9.0f / 16);
    out.Add(At(x1, y0), 3.0f / 16);
    out.Add(At(x0, y1), 3.0f / 16);
    out.Add(At(x1, y1), 1.0f / 16);
    return out;
  }
  // Pull: the cell (x, y) from its four of the picture twice as wide.
  SHERD_HD void Pull(const RimLevel& fine, int x, int y) const {
    RimCell sum;
    for (int v = 2 * y; v < std::min(2 * y + 2, fine.height); ++v) {
      for (int u = 2 * x; u < std::min(2 * x + 2, fine.width); ++u) sum.Add(fine.At(u, v), 1.0f);
    }
    sum.Saturate();
    At(x, y) = sum;
  }
  // Push: to the cell (x, y), as far as it is not known, what the coarser picture has there.
  SHERD_HD void Push(const RimLevel& coarse, int x, int y) const {
    RimCell& cell_here = At(x, y);
    const float missing = 1 - cell_here.weight;
    if (missing > 0) cell_here.Add(coarse.Between(x, y), missing);
  }
};

}  // namespace sherd
