// Which photograph sees which place of our own surface: the surface's depth as each photograph
// sees it. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "metaball/camera.h"
#include "metaball/control.h"
#include "metaball/photo/sight_map.h"
#include "metaball/renderer.h"
#include "metaball/scene.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"

namespace sherd {

class SurfaceDepths {
 public:
  // max_bytes: what all maps together may take; it decides on their size, kLargestSide at most.
  SurfaceDepths(const Survey& survey, const Level& level, const Surface& surface,
                std::size_t max_bytes);

  // Has the maps of these photographs drawn that are not there yet. `level` must be equal to the
  // one that was given first. Throws Cancelled, and as Renderer::Render does.
  void Prepare(const std::shared_ptr<const Level>& level, const std::vector<bool>& photos,
               Renderer* renderer, const Control& control);

  // By photograph; without planes where none was prepared. Valid until the next Prepare.
  std::span<const SightMap> sights() const { return sights_; }

  std::size_t MemoryBytes() const;

  static constexpr int kLargestSide = 640;

 private:
  struct Planes {
    std::vector<float> depth;
    std::vector<std::uint8_t> inside;
  };
  Camera CameraOf(std::size_t photo) const;
  void Render(const Scene& scene, std::size_t photo, Renderer* renderer, const Control& control);

  const Survey& survey_;
  int side_ = kLargestSide;
  Surface surface_;
  double jump_ = 0;               // world units: depths that differ by more are not one surface
  std::vector<Planes> planes_;    // by photograph
  std::vector<SightMap> sights_;  // of the planes
};

}  // namespace sherd
