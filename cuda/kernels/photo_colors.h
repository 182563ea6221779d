// The kernels that choose photographs for the hits of a frame and blend what they show. The
// formulas are those of metaball/photo/.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "cuda/kernels/device_ops.h"
#include "cuda/kernels/photo_tiles.h"
#include "metaball/appearance/light_view.h"
#include "metaball/camera.h"
#include "metaball/frame.h"
#include "metaball/hostdevice.h"
#include "metaball/photo/back_face.h"
#include "metaball/photo/photo_blend.h"
#include "metaball/photo/photo_choice.h"
#include "metaball/photo/sheet_view.h"
#include "metaball/photo/viewed_point.h"
#include "metaball/vec.h"

namespace sherd::kernels {

// A frame's planes; row-major, of the camera's size.
struct HitPlanes {
  Camera camera;  // world
  const float* depth;
  const Vec3f* normal;
  const std::int32_t* id;
  const Vec3f* light;  // null: as the photographs are
  Pixel* color;

  SHERD_HD int X(std::uint64_t pixel) const { return static_cast<int>(pixel % camera.width); }
  SHERD_HD int Y(std::uint64_t pixel) const { return static_cast<int>(pixel / camera.width); }
  SHERD_HD RayD RayOf(int x, int y) const { return RayThrough(camera, x + 0.5, y + 0.5); }
  SHERD_HD bool Hits(std::uint64_t pixel, const SheetView& sheet) const {
    return id[pixel] >= 0 && static_cast<std::uint32_t>(id[pixel]) < sheet.count;
  }
};

// ---- backs (metaball/photo/back_face.h) -------------------------------------------------------

// One thread a pixel.
struct FacePixels {
  HitPlanes planes;
  SheetView sheet;
  Facing* facing;
  std::uint32_t* backs;

  SHERD_HD void operator()(std::uint64_t pixel) const {
    Facing own = Facing::kUnknown;
    if (planes.Hits(pixel, sheet)) {
      own = FacingOf(sheet.normal[planes.id[pixel]],
                     planes.RayOf(planes.X(pixel), planes.Y(pixel)).direction);
    }
    facing[pixel] = own;
    if (own == Facing::kBack) AtomicAdd(backs, 1);
  }
};

// One thread a cell of the picture at half the size.
struct SumRims {
  static constexpr int kThreads = 128;
  static constexpr int kBlocksPerMultiprocessor = 4;  // 128 registers

  HitPlanes planes;
  SheetView sheet;
  const Facing* facing;
  RimLevel rim;

  SHERD_HD void operator()(std::uint64_t cell) const {
    const int x0 = static_cast<int>(cell % rim.width) * 2;
    const int y0 = static_cast<int>(cell / rim.width) * 2;
    const int width = planes.camera.width, height = planes.camera.height;
    RimCell sum;
    for (int y = y0; y < std::min(y0 + 2, height); ++y) {
      for (int x = x0; x < std::min(x0 + 2, width); ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width + x;
        if (facing[i] != Facing::kFront || !IsBesideABack(x, y)) continue;
        sum.Add(RimOf(sheet, planes.RayOf(x, y), planes.depth[i], planes.id[i], planes.normal[i]),
                1);
      }
    }
    sum.Saturate();
    rim.cell[cell] = sum;
  }

 private:
  SHERD_HD bool IsBesideABack(int x, int y) const {
    const int width = planes.camera.width, height = planes.camera.height;
    for (int v = y - kRimWidth; v <= y + kRimWidth; ++v) {
      for (int u = x - kRimWidth; u <= x + kRimWidth; ++u) {
        if (u < 0 || v < 0 || u >= width || v >= height) continue;
        if (facing[static_cast<std::size_t>(v) * width + u] == Facing::kBack) return true;
      }
    }
    return false;
  }
};

// One thread a cell of the coarser picture, or of the finer.
struct PullRims {
  RimLevel fine, coarse;

  SHERD_HD void operator()(std::uint64_t cell) const {
    coarse.Pull(fine, static_cast<int>(cell % coarse.width), static_cast<int>(cell / coarse.width));
  }
};
struct PushRims {
  RimLevel coarse, fine;

  SHERD_HD void operator()(std::uint64_t cell) const {
    fine.Push(coarse, static_cast<int>(cell % fine.width), static_cast<int>(cell / fine.width));
  }
};

// ---- colours ----------------------------------------------------------------------------------

// What becomes of a pixel, beside the number of its lookups.
inline constexpr std::uint8_t kInHole = 0x40, kNotLookedAt = 0x80;

// One thread a pixel of a part of the picture.
struct ChoosePixelPhotos {
  static constexpr int kThreads = 128;
  static constexpr int kBlocksPerMultiprocessor = 3;  // 168 registers; at 128 it spills
  static constexpr std::uint64_t kThreadsAtOnce = std::uint64_t{1} << 17;  // of many photographs

  HitPlanes planes;
  SheetView sheet;
  PhotosView photos;
  const Facing* facing;  // null where no pixel shows a back
  RimLevel rim;
  bool show_unseen;      // holes
  std::uint64_t first;   // pixel
  PhotoLookup* lookups;  // kMostPhotos a pixel of the part
  std::uint8_t* count;   // a pixel of the part

  SHERD_HD void operator()(std::uint64_t thread) const {
    const std::uint64_t pixel = first + thread;
    count[thread] = kNotLookedAt;
    if (!planes.Hits(pixel, sheet) || !(planes.color[pixel].a > 0)) return;
    const int x = planes.X(pixel), y = planes.Y(pixel);
    PixelHit hit{x, y, planes.depth[pixel], planes.normal[pixel], planes.id[pixel]};
    std::uint8_t kind = 0;
    if (facing && facing[pixel] == Facing::kBack) {
      const RimCell filled = rim.Between(x, y);
      if (filled.weight > 0) {
        hit.depth = filled.depth / filled.weight;
        hit.normal = Normalized(filled.normal, -hit.normal);
        hit.on_sheet = true;
        kind = kInHole;
      }
    }
    int chosen = 0;
    if (!(kind == kInHole && show_unseen)) {
      const ViewedPoint point = ViewPoint(planes.camera, sheet, hit, [](std::uint32_t, float) {});
      const auto share_of = [&](std::uint32_t photo) {
        return hit.on_sheet ? 0.0f : sheet.ShareOf(photo, point.hit, hit.id);
      };
      chosen = ChoosePhotos(photos, point, share_of, lookups + thread * kMostPhotos);
    }
    count[thread] = static_cast<std::uint8_t>(kind | chosen);
  }
};

// Pixels by what became of them, counted apart so that few threads add to the same place.
struct PhotoTally {
  static constexpr int kPlaces = 64;
  std::uint32_t pixels, from_photos, across_holes, without_photo;
};

// One thread a pixel of a part of the picture.
struct BlendPixelPhotos {
  static constexpr int kThreads = 128;
  static constexpr int kBlocksPerMultiprocessor = 8;  // 64 registers

  HitPlanes planes;
  bool show_unseen;
  Vec3f unseen;         // linear
  std::uint64_t first;  // pixel
  // kMostPhotos a pixel of the part.
  const PhotoLookup* lookups;
  const PhotoColors* colors;
  const std::uint8_t* there;
  const std::uint8_t* count;  // a pixel of the part
  PhotoTally* tally;          // kPlaces

  SHERD_HD void operator()(std::uint64_t thread) const {
    if (count[thread] == kNotLookedAt) return;
    PhotoTally& own = tally[thread / 256 % PhotoTally::kPlaces];
    AtomicAdd(&own.pixels, 1);
    float weight[kMostPhotos];
    PhotoColors color[kMostPhotos];
    int n = 0;
    const int looked_up = count[thread] & SamplePhotos::kCountMask;
    for (int k = 0; k < looked_up; ++k) {
      const std::uint64_t i = thread * kMostPhotos + k;
      if (!there[i]) continue;
      weight[n] = lookups[i].weight;
      color[n++] = colors[i];
    }
    Vec3f c = unseen;
    if (n > 0) {
      c = BlendPhotos(weight, color, n);
      AtomicAdd(&own.from_photos, 1);
      if (count[thread] & kInHole) AtomicAdd(&own.across_holes, 1);
    } else {
      AtomicAdd(&own.without_photo, 1);
      if (!show_unseen) return;
    }
    const std::uint64_t pixel = first + thread;
    if (planes.light) c = ColorInLight(c, planes.light[pixel]);
    const float a = planes.color[pixel].a;
    planes.color[pixel] = {c.x * a, c.y * a, c.z * a, a};
  }
};

}  // namespace sherd::kernels
