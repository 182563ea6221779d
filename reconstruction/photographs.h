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
#include "metaball/photo/photo_shader.h"
#include "metaball/renderer.h"
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

struct PhotoShadingOptions {
  int memory_mb = 1024;                  // bounds the pixels held at any time
  std::vector<std::uint32_t> leave_out;  // photographs that are not looked up; any order
  bool even_exposures = true;            // gains by photograph and channel, from what they share
  bool show_unseen = false;  // kUnseenColor where no photograph sees the surface, or it has a hole
};

struct PhotoShadingStats {
  std::uint64_t pixels = 0;         // surface pixels that were looked at
  std::uint64_t from_photos = 0;    // coloured from at least one photograph
  std::uint64_t across_holes = 0;   // of these, where the surface shows its back (Shade)
  std::uint64_t without_photo = 0;  // kept the blended colour: no photograph sees the place
  std::uint64_t photos_used = 0;
  std::uint64_t photos_unreadable = 0;
  double seconds = 0;
  double seconds_once = 0;  // of these, for what further pictures find there: exposures, depth
                            // maps, photographs in memory
  std::vector<std::string> warnings;
};

// Replaces the blended colour of a finished frame by that of the photographs. Every hit point is
// moved to the sheet its metaballs stand for and projected into the photographs that see it,
// distortion included. What a photograph sees is found out by rendering the surface's depth as the
// photograph sees it, once for a cloud and surface, and by the photographs that the metaballs list
// (by their weights in the field). Of those that see the place, the ones that look at it most as
// the viewer does, finely enough and away from borders and outlines, are sampled with the pixel's
// footprint in linear light, their exposures evened out, and blended: coarse detail smoothly, fine
// detail almost from the best alone, with little say for one that contradicts the others. Where the
// surface shows its back, there is a hole in it: the photographs are looked up where it would be,
// carried across from the pixels around.
class PhotographShader {
 public:
  // The survey must outlive the shader.
  explicit PhotographShader(const Survey& survey, const PhotoShadingOptions& options = {});
  ~PhotographShader();
  PhotographShader(PhotographShader&&) noexcept;

  // Works on `device` from now on; on the CPU without one. A device that fails (DeviceError) is
  // given up for the CPU, one whose memory is short (ResourceError) for this picture, with a
  // warning in the stats.
  void ShadeOn(std::unique_ptr<PhotoShader> device);
  // What each photograph sees is drawn by `renderer` from now on, which must live until another one
  // is named; null: by the CPU.
  void DrawWith(Renderer* renderer);

  // `frame` must have been rendered from the level's cloud with `surface` by `camera`, with depth,
  // normal and id planes. The photographs' colours are lit by the frame's light plane, and are left
  // as they are where it has none. Throws Cancelled.
  PhotoShadingStats Shade(const std::shared_ptr<const Level>& level, const Surface& surface,
                          const Camera& camera, Frame* frame, const Control& control = {});
  // The same of a level that nobody else holds: what is known of one before is found by its
  // content, which takes a walk through all of it.
  PhotoShadingStats Shade(const Level& level, const Surface& surface, const Camera& camera,
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
