// A frame as a picture file: background, sRGB, metadata, written whole or not at all.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "metaball/frame.h"
#include "metaball/vec.h"

namespace sherd {

struct Background {
  bool transparent = false;
  Vec3f srgb{1, 1, 1};  // encoded values in [0, 1]
};

// Puts the frame on the background (linear light, over). `transparent` leaves alpha.
void Composite(const Background& background, Frame* frame);

struct PictureOptions {
  bool linear = false;  // write linear values, without the sRGB curve
  bool alpha = false;   // four channels
  int bits = 8;         // 8 or 16 (PNG, TIFF); EXR is always half or float
  double dpi = 0;       // written when > 0
  std::map<std::string, std::string> metadata;
};

// By extension: .png, .tif/.tiff, .exr, .jpg. Scanlines are streamed: no side limit but the
// format's. Throws OutputError (also for an unknown extension); then no file was made or changed.
void WritePicture(const std::string& path, const Frame& frame, const PictureOptions& options);
// One float channel, distance along the ray in world units, 0 where nothing is hit.
void WriteDepth(const std::string& path, const Frame& frame);

// Root mean square difference in 8-bit units over all channels of two pictures of one size, and the
// share of pixels off by more than 8/255 in any channel. Throws InputError when sizes differ.
struct PictureDifference {
  double rms = 0, share_off_by_8 = 0, largest = 0;
};
PictureDifference ComparePictures(const std::string& path_a, const std::string& path_b);

}  // namespace sherd
