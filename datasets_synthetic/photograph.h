// Takes the photographs, and draws their undistorted pictures.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "datasets_synthetic/lens.h"
#include "datasets_synthetic/scene.h"
#include "datasets_synthetic/shots.h"
#include "metaball/control.h"

namespace sherd::synthetic {

struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // sRGB, three bytes a pixel, row-major
};

struct PhotographOptions {
  std::uint32_t seed = 1;
  double sensor_noise = 1.0;  // standard deviation, 8-bit levels
  int threads = 0;
};

// sRGB [0, 1] of linear radiance: the camera's exposure and its curve, which lets highlights go
// softly.
Vec3f Develop(const Vec3f& radiance, float exposure);

// The photograph through the lens, distortion included. BakeLight must have been called. Throws
// Cancelled.
Picture TakePhotograph(const TrenchScene& scene, const Shot& shot, const Lens& lens,
                       const PhotographOptions& options, const Control& control);

// The picture as the pinhole camera `pinhole` would show it, interpolated (Catmull-Rom).
Picture Undistort(const Picture& picture, const Lens& lens, const Lens& pinhole, int threads);

// Writes a JPEG with EXIF focal length. Throws OutputError.
void WriteJpeg(const std::string& path, const Picture& picture, const Shot& shot, int quality);

}  // namespace sherd::synthetic
