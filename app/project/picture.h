// A frame as a picture file: background, sRGB, metadata, written whole or not at all.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "metaball/frame.h"
#include "metaball/vec.h"

namespace sherd {

struct Background {
  bool transparent = false;
  Vec3f srgb{1, 1, 1};  // encoded values in [0, 1]
};

// "transparent", or three sRGB values in [0, 1] as "r,g,b". Throws InputError.
Background ParseBackground(const std::string& text);

// Puts the frame on the background (linear light, over). `transparent` leaves alpha.
void Composite(const Background& background, Frame* frame);

struct PictureOptions {
  bool linear = false;  // write linear values, without the sRGB curve
  bool alpha = false;   // four channels
  int bits = 8;         // 8 or 16 (PNG, TIFF); EXR is always linear: 32 is float, else half
  double dpi = 0;       // written when > 0
  // Written as text fields (PNG), attributes (EXR) and, in all formats, as lines of the
  // description.
  std::map<std::string, std::string> metadata;
};

// Writes a picture in parts, from the top: what does not fit in memory is never held whole.
class PictureWriter {
 public:
  // Opens a temporary file beside `path`. Throws OutputError: unknown extension (.png, .tif, .tiff,
  // .exr, .jpg and .jpeg are known), alpha or 16 bits in a format that has none, a folder that does
  // not exist or may not be written.
  PictureWriter(const std::string& path, int width, int height, const PictureOptions& options);
  ~PictureWriter();  // without Finish: nothing was made or changed
  PictureWriter(PictureWriter&&) noexcept;

  // The next rows: the strip has the picture's width. Throws OutputError.
  void WriteRows(const Frame& strip);
  // All rows must have been written. Throws OutputError (disk full); then no file was changed.
  void Finish();

 private:
  friend class DepthWriter;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The same for the depth plane: an EXR file of one float channel, called Y (the name that most
// programs read), distance along the ray in world units, 0 where nothing is hit.
class DepthWriter {
 public:
  DepthWriter(const std::string& path, int width, int height);
  ~DepthWriter();
  DepthWriter(DepthWriter&&) noexcept;
  void WriteRows(const Frame& strip);  // the strip has a depth plane
  void Finish();

 private:
  std::unique_ptr<PictureWriter::Impl> impl_;
};

// By extension, as PictureWriter. Throws OutputError; then no file was made or changed.
void WritePicture(const std::string& path, const Frame& frame, const PictureOptions& options);
void WriteDepth(const std::string& path, const Frame& frame);

// Root mean square difference in 8-bit units over all channels of two pictures of one size, the
// largest, and the share of pixels off by more than 8/255 in any channel. A picture without alpha
// compares as opaque, grey as three equal channels. Throws InputError when a file cannot be read or
// the sizes differ.
struct PictureDifference {
  double rms = 0, share_off_by_8 = 0, largest = 0;
};
PictureDifference ComparePictures(const std::string& path_a, const std::string& path_b);

// 8-bit sRGB of a linear value, by table; the same as Quantize8(SrgbFromLinear(v)) but for values
// within one rounding of a step.
std::uint8_t EncodeSrgb8(float linear);

}  // namespace sherd
