// Photographs as pixels, decoded by OpenImageIO and held only as finely as they are looked at,
// within a bound. Never rotated by EXIF: COLMAP's intrinsics refer to the stored pixels.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/color.h"
#include "metaball/control.h"
#include "metaball/frame.h"
#include "metaball/scene.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"

namespace sherd {

struct PhotoSize {
  int width = 0, height = 0;
};
// Reads the header alone. Throws InputError when the file is no image OpenImageIO can read.
PhotoSize ReadPhotoSize(const std::string& path);

// A whole photograph as 8-bit sRGB, row-major (for display beside the surface). max_side > 0:
// reduced so that neither side is longer.
struct PhotoImage {
  int width = 0, height = 0;
  std::vector<Rgb8> pixels;
};
PhotoImage ReadPhoto(const std::string& path, int max_side = 0);

struct PhotoShadingStats {
  std::uint64_t pixels = 0;         // surface pixels that were looked at
  std::uint64_t from_photos = 0;    // coloured from at least one photograph
  std::uint64_t without_photo = 0;  // kept the blended colour: no photograph sees the place
  std::uint64_t photos_used = 0;
  std::uint64_t photos_unreadable = 0;
  double seconds = 0;
  std::vector<std::string> warnings;
};

// Replaces the blended colour of a finished frame by that of the photographs. The metaballs whose
// support holds a hit point say, by their weights in the field, where the surface they stand for
// lies (the field's surface is the thickness of a metaball in front of it) and which photographs
// see it. The point is projected into those, distortion included; each is sampled with the pixel's
// footprint (MIP levels, several samples along the longer axis) in linear light, and the samples
// are blended by how squarely, how finely and how far from its border each photograph sees the
// place.
class PhotographShader {
 public:
  // memory_mb bounds the pixels held at any time. The survey must outlive the shader.
  explicit PhotographShader(const Survey& survey, int memory_mb = 1024);
  ~PhotographShader();
  PhotographShader(PhotographShader&&) noexcept;

  // `frame` must have been rendered from `level` by `camera` with depth, normal and id planes. The
  // light of `lighting` is applied to the photographs' colours. Throws Cancelled.
  PhotoShadingStats Shade(const Level& level, const Camera& camera, const Lighting& lighting,
                          Frame* frame, const Control& control = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The camera of a photograph: its pose and pinhole intrinsics, scaled to width x height (0: its
// own).
Camera CameraOfPhotograph(const Survey& survey, std::size_t photo_idx, int width = 0,
                          int height = 0);

}  // namespace sherd
