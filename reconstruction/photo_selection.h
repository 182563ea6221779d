// Which photographs give a surface point its colour, seen from where it is looked at. Internal to
// reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/photo/lookup.h"
#include "reconstruction/photo_set.h"
#include "reconstruction/surface_depths.h"
#include "reconstruction/surface_point.h"

namespace sherd {

// A surface point as one pixel of a picture sees it; world units.
struct ViewedPoint {
  Vec3d hit{};               // on the iso-surface: what the depth maps are compared with
  SurfacePoint surface;      // on the sheet the metaballs stand for: what is projected
  Vec3d to_viewer{};         // unit
  Vec3d side_x{}, side_y{};  // the pixel's sides, laid on the surface
  double tolerance = 0;      // how far the iso-surface may be off
};

// Photographs blended at one place.
inline constexpr std::size_t kMostPhotos = 4;

class PhotoSelector {
 public:
  // candidates: photographs that are looked at, in ascending order; their depth maps are there.
  PhotoSelector(const PhotoSet& photos, const SurfaceDepths& depths,
                std::vector<std::uint32_t> candidates)
      : photos_(photos), depths_(depths), candidates_(std::move(candidates)) {}

  // Appends at most kMostPhotos lookups, best first, with `target` and positive weights
  // (unstructured lumigraph rendering: Buehler, Bosse, McMillan, Gortler, Cohen 2001). Every
  // photograph that sees the place has a penalty: the angle between its direction and the viewer's,
  // and what it lacks in resolution, in distance from its border, from an outline, and in
  // visibility or keeps too little from its mask. The weight falls from the least penalty to 0 at
  // the penalty of the best photograph left out, so that none enters or leaves with a seam.
  // Thread-safe.
  void Select(const ViewedPoint& point, std::uint32_t target, std::vector<PhotoLookup>* out) const;

  // The photographs, most alike in direction first, in whose picture the point lies, unmasked, and
  // that it faces; at most `most`. Depth maps are not asked.
  void Nearest(const Vec3d& point, const Vec3f& normal, const Vec3d& to_viewer, std::size_t most,
               std::vector<std::uint32_t>* out) const;

 private:
  void Choose(const ViewedPoint& point, std::uint32_t target, std::vector<PhotoLookup>* out) const;

  const PhotoSet& photos_;
  const SurfaceDepths& depths_;
  std::vector<std::uint32_t> candidates_;
};

}  // namespace sherd
