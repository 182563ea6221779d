// Which photographs give a surface point its colour, seen from where it is looked at; on the CPU
// and on the GPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "metaball/hostdevice.h"
#include "metaball/photo/lookup.h"
#include "metaball/photo/mask_distance_view.h"
#include "metaball/photo/photo_camera.h"
#include "metaball/photo/sight_map.h"
#include "metaball/vec.h"

namespace sherd {

// A surface point as one pixel of a picture sees it; world units.
struct ViewedPoint {
  Vec3d hit{};               // on the iso-surface: what the depth maps are compared with
  Vec3d position{};          // on the sheet the metaballs stand for: what is projected
  Vec3f normal{};            // of the sheet, unit
  Vec3d to_viewer{};         // unit
  Vec3d side_x{}, side_y{};  // the pixel's sides, laid on the surface
  double tolerance = 0;      // how far the iso-surface may be off
};

// The photographs; arrays that somebody else holds, by photograph.
struct PhotosView {
  const PhotoCamera* camera = nullptr;
  const SightMap* sight = nullptr;
  const MaskDistanceView* mask = nullptr;  // null: none has one
  // Those that are looked at, in ascending order; their sights are there.
  const std::uint32_t* candidate = nullptr;
  std::uint32_t candidates = 0;

  // The weight that the mask of lookup.photo leaves a lookup at `point`: 0 where SampleFootprint
  // would look at a black pixel, growing to 1 over the width of its surroundings.
  SHERD_HD double Unmasked(const PhotoLookup& lookup, const Vec3d& point) const {
    if (!mask || !mask[lookup.photo].quarters) return 1;
    const PhotoCamera& own = camera[lookup.photo];
    double x, y;
    if (!own.ProjectIntoOriginal(point, &x, &y)) return 0;
    const double distance = mask[lookup.photo].At(x, y) / own.original_px_per_px;
    return std::clamp((distance - FootprintReach(lookup)) / SurroundingsWidth(lookup), 0.0, 1.0);
  }
};

// Photographs blended at one place.
inline constexpr int kMostPhotos = 4;

// The photographs that a point faces, those most alike in direction to the viewer's first.
class PhotoOrder {
 public:
  struct Direction {
    double cosine = 2;  // of the angle to the viewer's
    std::uint32_t photo = 0;
    SHERD_HD double Angle() const { return std::acos(std::clamp(cosine, -1.0, 1.0)); }
    // More alike in direction.
    SHERD_HD bool IsBefore(const Direction& other) const {
      return cosine != other.cosine ? cosine > other.cosine : photo < other.photo;
    }
  };

  SHERD_HD PhotoOrder(const PhotosView& photos, const Vec3d& position, const Vec3f& normal,
                      const Vec3d& to_viewer)
      : photos_(photos),
        position_(position),
        normal_(normal.cast<double>()),
        to_viewer_(to_viewer) {}

  // False at the end.
  SHERD_HD bool Next(Direction* next) {
    if (at_ == held_) {
      if (held_ < kHeld && held_ >= 0) return false;
      Fill();
      if (held_ == 0) return false;
    }
    last_ = *next = direction_[at_++];
    return true;
  }

 private:
  // Few are ever looked at, so that few are sorted; the others are gone through once more.
  static constexpr int kHeld = 8;
  static constexpr double kLeastCosine = 0.05;

  // The first that come after the last one that was given out.
  SHERD_HD void Fill() {
    const bool from_start = held_ < 0;
    held_ = at_ = 0;
    for (std::uint32_t k = 0; k < photos_.candidates; ++k) {
      const std::uint32_t photo = photos_.candidate[k];
      const PhotoCamera& camera = photos_.camera[photo];
      if (!camera.usable) continue;
      const Vec3d way = camera.center - position_;
      const double facing = Dot(way, normal_);
      if (!(facing > 0)) continue;
      const double distance = Length(way);
      if (!(facing > kLeastCosine * distance)) continue;
      const Direction direction{Dot(way, to_viewer_) / distance, photo};
      if (!from_start && !last_.IsBefore(direction)) continue;
      int place = held_ < kHeld ? held_++ : kHeld;
      if (place == kHeld) {
        if (!direction.IsBefore(direction_[kHeld - 1])) continue;
        place = kHeld - 1;
      }
      for (; place > 0 && direction.IsBefore(direction_[place - 1]); --place) {
        direction_[place] = direction_[place - 1];
      }
      direction_[place] = direction;
    }
  }

  const PhotosView& photos_;
  Vec3d position_, normal_, to_viewer_;
  Direction direction_[kHeld], last_;
  int at_ = -1, held_ = -1;
};

// 1 inside, falling to 0 over the outer twentieth of the picture.
SHERD_HD double BorderWeight(double x, double y, double width, double height) {
  const double margin = 0.05 * std::min(width, height);
  const double distance = std::min(std::min(x, y), std::min(width - x, height - y));
  const double t = std::clamp(distance / margin, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

namespace photo_choice_internal {

// Penalties, in radians of viewing direction (docs/fidelity.md has what each is worth).
inline constexpr double kPerOctaveTooCoarse = 0.05;  // the picture's pixels finer than the
                                                     // photograph's
inline constexpr double kAtAnOutline = 0.15;
inline constexpr double kHalfHidden = 0.3;  // or in the middle of the border, or halfway to a mask
inline constexpr double kNotListed = 0.05;  // the reconstruction did not use it here
inline constexpr double kMost = 4.0;
inline constexpr double kLeast = 0.02;  // below this, penalties count alike

struct Choice {
  double penalty = 0;
  PhotoLookup lookup;
};

// What the photograph at that angle would give; false where it gives nothing.
template <class Shares>
SHERD_HD bool Look(const PhotosView& photos, const ViewedPoint& point, std::uint32_t photo,
                   double angle, const Shares& shares, Choice* choice) {
  const PhotoCamera& camera = photos.camera[photo];
  double x = 0, y = 0, ax = 0, ay = 0, bx = 0, by = 0;
  if (!camera.Project(point.position, &x, &y)) return false;
  const float listed = shares(photo);
  const PhotoSight sight = photos.sight[photo].At(point.hit, point.normal, point.tolerance);
  // Where the depth map contradicts the reconstruction's own list, the list has half a say.
  double clear = std::max<double>(sight.visible, 0.5 * listed) *
                 BorderWeight(x, y, camera.width, camera.height);
  if (!(clear > 0.01)) return false;
  if (!camera.Project(point.position + point.side_x, &ax, &ay) ||
      !camera.Project(point.position + point.side_y, &bx, &by)) {
    return false;
  }
  PhotoLookup& lookup = choice->lookup;
  lookup.photo = photo;
  lookup.x = static_cast<float>(x);
  lookup.y = static_cast<float>(y);
  SetFootprint(ax - x, ay - y, bx - x, by - y, &lookup);
  clear *= photos.Unmasked(lookup, point.position);
  if (!(clear > 0)) return false;
  const double coarse = std::max(0.0, -std::log2(std::max(1e-3, double(lookup.width_px))));
  choice->penalty = angle + kPerOctaveTooCoarse * coarse + kAtAnOutline * (1 - sight.inside) +
                    kHalfHidden * (1 / clear - 1) + kNotListed * (1 - listed);
  return choice->penalty < kMost;
}

template <class Shares>
SHERD_HD int Choose(const PhotosView& photos, const ViewedPoint& point, const Shares& shares,
                    PhotoLookup* out) {
  PhotoOrder order(photos, point.position, point.normal, point.to_viewer);
  Choice best[kMostPhotos + 1];
  int count = 0;
  PhotoOrder::Direction next;
  // In the order of the angle, of which no penalty is less: most are never looked at.
  while (order.Next(&next)) {
    const double angle = next.Angle();
    if (count > kMostPhotos && angle >= best[kMostPhotos].penalty) break;
    Choice choice;
    if (!Look(photos, point, next.photo, angle, shares, &choice)) continue;
    if (count > kMostPhotos && choice.penalty >= best[kMostPhotos].penalty) continue;
    int at = count < kMostPhotos ? count : kMostPhotos;
    for (; at > 0 && best[at - 1].penalty > choice.penalty; --at) best[at] = best[at - 1];
    best[at] = choice;
    if (count <= kMostPhotos) ++count;
  }
  const double limit = count > kMostPhotos ? best[kMostPhotos].penalty : kMost;
  const int chosen = count < kMostPhotos ? count : kMostPhotos;
  for (int i = 0; i < chosen; ++i) {
    const double penalty = best[i].penalty > kLeast ? best[i].penalty : kLeast;
    const double root = (1 - best[i].penalty / limit) / penalty;
    best[i].lookup.weight = static_cast<float>(std::max(root * root, 1e-9));
    out[i] = best[i].lookup;
  }
  return chosen;
}

}  // namespace photo_choice_internal

// Writes at most kMostPhotos lookups, best first, with positive weights, and returns how many
// (unstructured lumigraph rendering: Buehler, Bosse, McMillan, Gortler, Cohen 2001). Every
// photograph that sees the place has a penalty: the angle between its direction and the viewer's,
// and what it lacks in resolution, in distance from its border, from an outline, and in visibility
// or keeps too little from its mask. The weight falls from the least penalty to 0 at the penalty of
// the best photograph left out, so that none enters or leaves with a seam. shares(photo): the share
// of the field there that comes from metaballs the photograph is listed for.
template <class Shares>
SHERD_HD int ChoosePhotos(const PhotosView& photos, const ViewedPoint& point, const Shares& shares,
                          PhotoLookup* out) {
  const int chosen = photo_choice_internal::Choose(photos, point, shares, out);
  if (chosen > 0) return chosen;
  // No photograph faces the sheet, whose normal may be wrong (noise): a patch that faces the
  // viewer, where the ray met the surface.
  ViewedPoint facing = point;
  facing.position = point.hit;
  facing.normal = point.to_viewer.cast<float>();
  const Vec3d& to_viewer = point.to_viewer;
  facing.side_x = point.side_x - to_viewer * Dot(point.side_x, to_viewer);
  facing.side_y = point.side_y - to_viewer * Dot(point.side_y, to_viewer);
  return photo_choice_internal::Choose(photos, facing, shares, out);
}

}  // namespace sherd
