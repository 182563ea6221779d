// Which photograph sees which place of our own surface: the surface's depth as each photograph
// sees it. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "metaball/camera.h"
#include "metaball/control.h"
#include "metaball/renderer.h"
#include "metaball/scene.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"

namespace sherd {

// How a photograph sees a place.
struct PhotoSight {
  // 0: something of the surface is in front of it; 1: nothing is. In between at the rim of
  // what is in front.
  float visible = 0;
  // 0: on an outline (the depth jumps here), 1: two pixels of the depth map from any.
  float inside = 0;
};

class SurfaceDepths {
 public:
  // max_bytes: what all maps together may take; it decides on their size, kLargestSide at most.
  SurfaceDepths(const Survey& survey, const Level& level, const Surface& surface,
                std::size_t max_bytes);

  // Renders the maps of these photographs that are not there yet. `level` must be equal to the one
  // that was given first. Throws Cancelled.
  void Prepare(const Level& level, const std::vector<bool>& photos, const Control& control);

  // `point`: on the iso-surface, world; normal: unit; tolerance: how far behind the surface still
  // counts as on it, world units. The map must have been prepared. Outside of the map nothing is
  // known: visible 0. Thread-safe.
  PhotoSight At(std::size_t photo, const Vec3d& point, const Vec3f& normal, double tolerance) const;

  // A digest of what the maps show; equal for equal clouds and surfaces.
  static std::uint64_t KeyOf(const Level& level, const Surface& surface);

  std::size_t MemoryBytes() const;

  static constexpr int kLargestSide = 640;

 private:
  struct Map {
    Camera camera;
    std::vector<float> depth;          // along the ray; 0: nothing there
    std::vector<std::uint8_t> inside;  // PhotoSight::inside * 255
  };
  Camera CameraOf(std::size_t photo) const;
  void Render(const Level& level, std::size_t photo, const Control& control);

  const Survey& survey_;
  int side_ = kLargestSide;
  Surface surface_;
  double jump_ = 0;  // world units: depths that differ by more are not one surface
  std::unique_ptr<Renderer> renderer_;
  std::vector<std::unique_ptr<Map>> maps_;
};

}  // namespace sherd
