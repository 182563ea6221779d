// Pixels that show the surface from its back: through a hole into the inside, or a lone metaball
// whose normal is wrong (metaball/photo/back_face.h). Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/camera.h"
#include "metaball/frame.h"
#include "metaball/photo/sheet_view.h"
#include "metaball/vec.h"

namespace sherd {

class BackFaces {
 public:
  // frame: with depth, normal and id planes, of the sheet's metaballs and the camera.
  BackFaces(const SheetView& sheet, const Camera& camera, const Frame& frame);

  struct Pixel {
    std::uint32_t pixel = 0;  // into the frame
    float depth = 0;          // world units along its ray
    Vec3f normal{};           // unit
  };
  // Null for a pixel that shows a front, or where nothing around it does.
  const Pixel* Find(std::size_t pixel) const;

 private:
  std::vector<Pixel> pixels_;  // in ascending order
};

}  // namespace sherd
