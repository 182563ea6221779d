// The interface in front of every machine that colours a frame from photographs.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "metaball/camera.h"
#include "metaball/color.h"
#include "metaball/control.h"
#include "metaball/frame.h"
#include "metaball/photo/mask_distance_view.h"
#include "metaball/photo/photo_camera.h"
#include "metaball/photo/pyramid.h"
#include "metaball/photo/sheet_view.h"
#include "metaball/photo/sight_map.h"
#include "metaball/vec.h"

namespace sherd {

inline constexpr Rgb8 kUnseenColor{255, 0, 255};

// What the photographs' colours of a surface are made from, in the host's memory. Arrays are by
// photograph.
struct PhotoScene {
  SheetView sheet;
  std::uint64_t sheet_key = 0;  // differs for different metaballs
  std::span<const PhotoCamera> camera;
  std::span<const SightMap> sight;
  std::uint64_t sight_key = 0;             // differs for different surfaces
  std::span<const MaskDistanceView> mask;  // none, or one each
  std::span<const Vec3f> gain;             // factors by channel; none: 1
  // Those that may be looked into, in ascending order; their sights are there.
  std::span<const std::uint32_t> candidates;
  bool show_unseen = false;  // kUnseenColor where no photograph sees the surface, or it has a hole
};

struct PhotoRequest {
  std::uint32_t photo = 0;
  int finest = 0;  // the finest level that is needed
};

// Where the pixels come from.
class PhotoPixels {
 public:
  virtual ~PhotoPixels() = default;
  // Calls visit(i, pyramid) once for each request, in any order, one after the other. The pyramid
  // is coarser than asked where memory does not hold more, and null for a photograph that cannot be
  // read. Throws Cancelled.
  virtual void Fetch(std::span<const PhotoRequest> requests,
                     const std::function<void(std::size_t i, const PhotoPyramid* pyramid)>& visit,
                     const Control& control) = 0;
};

struct PhotoCounts {
  std::uint64_t pixels = 0;         // surface pixels that were looked at
  std::uint64_t from_photos = 0;    // coloured from at least one photograph
  std::uint64_t across_holes = 0;   // of these, where the surface shows its back
  std::uint64_t without_photo = 0;  // no photograph sees the place
  std::vector<bool> used;           // by photograph: whether it was looked into
};

class PhotoShader {
 public:
  virtual ~PhotoShader() = default;

  // Gives every hit of `frame`, which has depth, normal and id planes, the colour that the
  // photographs show there, in the light of its light plane where it has one; what no photograph
  // sees keeps its own. ids that are not the sheet's are left alone. Not thread-safe. Throws
  // Cancelled; DeviceError and ResourceError where it works on a device. What throws leaves the
  // frame as it was.
  virtual void Shade(const PhotoScene& scene, const Camera& camera, PhotoPixels* pixels,
                     Frame* frame, PhotoCounts* counts, const Control& control) = 0;
};

}  // namespace sherd
