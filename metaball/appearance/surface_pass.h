// What the passes over a finished frame know of a hit, and texture lookups there.
#pragma once

#include <cstddef>

#include "metaball/appearance/appearance.h"
#include "metaball/camera.h"
#include "metaball/frame.h"
#include "metaball/vec.h"

namespace sherd {

struct SurfacePoint {
  std::size_t pixel = 0;
  Vec3d position{};   // world
  Vec3d dx{}, dy{};   // to where the next pixel's rays (right, down) meet the tangent plane, world
  Vec3f normal{};     // the field's, unit
  Vec3f to_viewer{};  // unit
};

// The hit of pixel (x, y) of a frame with depth and normal planes.
SurfacePoint SurfacePointAt(const Camera& camera, const Frame& frame, int x, int y);

// A texture prepared for one frame.
class TexturePass {
 public:
  // The frame holds the UV plane of lookup.uv where the coordinates come from a channel.
  TexturePass(const TextureLookup& lookup, const Frame& frame);

  Vec3f ColorAt(const SurfacePoint& point) const;
  // The same, and the directions in which u and v grow along the surface: unit vectors orthogonal
  // to the normal; zero where they are not known.
  Vec3f ValueAt(const SurfacePoint& point, Vec3f* along_u, Vec3f* along_v) const;

 private:
  // (u, v) and its changes along the two vectors to the next pixels.
  void CoordinatesAt(const SurfacePoint& point, SurfaceUv* uv, UvFootprint* footprint) const;

  const TextureLookup& lookup_;
  const UvPlane* plane_ = nullptr;
};

// thesis 3.5 and 3.6: the normal that light falls on.
class NormalPass {
 public:
  NormalPass(const Appearance& appearance, const Frame& frame);
  Vec3f NormalAt(const SurfacePoint& point) const;

 private:
  const Appearance& appearance_;
  const Frame& frame_;
  const ChannelPlane* plane_ = nullptr;
  TexturePass image_;
};

}  // namespace sherd
