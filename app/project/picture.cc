#include "app/project/picture.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <vector>

#include "app/project/picture_file.h"
#include "metaball/color.h"
#include "metaball/error.h"

#ifndef SHERD_VERSION
#error "SHERD_VERSION comes from the build"
#endif

namespace sherd {
namespace {

enum class Format { kPng, kTiff, kExr, kJpeg };

Format FormatOf(const std::string& path) {
  const std::size_t dot = path.find_last_of("./");
  std::string extension = dot == std::string::npos || path[dot] == '/' ? "" : path.substr(dot);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".png") return Format::kPng;
  if (extension == ".tif" || extension == ".tiff") return Format::kTiff;
  if (extension == ".exr") return Format::kExr;
  if (extension == ".jpg" || extension == ".jpeg") return Format::kJpeg;
  throw OutputError(path, "a picture's name ends in .png, .tif, .exr or .jpg");
}

const char* OiioName(Format format) {
  switch (format) {
    case Format::kPng:
      return "png";
    case Format::kTiff:
      return "tiff";
    case Format::kExr:
      return "openexr";
    case Format::kJpeg:
      return "jpeg";
  }
  return "";
}

// The linear value at which code k begins: LinearFromSrgb((k - 0.5) / 255).
struct SrgbSteps {
  std::array<float, 257> begin;         // [256]: infinity
  std::array<std::uint8_t, 4097> code;  // of the values i / 4096
  SrgbSteps() {
    begin[0] = -INFINITY;
    for (int k = 1; k < 256; ++k) {
      const double v = (k - 0.5) / 255;
      begin[static_cast<std::size_t>(k)] =
          static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
    }
    begin[256] = INFINITY;
    std::size_t k = 0;
    for (std::size_t i = 0; i <= 4096; ++i) {
      while (static_cast<float>(i) / 4096.0f >= begin[k + 1]) ++k;
      code[i] = static_cast<std::uint8_t>(k);
    }
  }
};

// 0 to 1 in 16 bits; as Quantize8.
std::uint16_t Quantize16(float v) {
  if (!(v > 0.0f)) return 0;
  if (v >= 1.0f) return 65535;
  return static_cast<std::uint16_t>(v * 65535.0f + 0.5f);
}

// Straight (not premultiplied) colour.
Pixel Straight(const Pixel& p) {
  if (!(p.a > 0) || p.a == 1.0f) return p;
  return {p.r / p.a, p.g / p.a, p.b / p.a, p.a};
}

void CheckSize(const std::string& path, Format format, int width, int height) {
  if (width < 1 || height < 1) throw OutputError(path, "a picture needs at least one pixel a side");
  if (format == Format::kJpeg && (width > 65500 || height > 65500)) {
    throw OutputError(path, "a JPEG side holds at most 65500 pixels; write a TIFF or a PNG");
  }
}

void AddMetadata(const PictureOptions& options, Format format, OIIO::ImageSpec* spec) {
  std::string description;
  for (const auto& [key, value] : options.metadata) {
    description += (description.empty() ? "" : "\n") + key + ": " + value;
    // TIFF and JPEG have no free text fields: there the description alone carries them.
    if (format == Format::kPng || format == Format::kExr) spec->attribute("sherd:" + key, value);
  }
  if (!description.empty()) spec->attribute("ImageDescription", description);
  spec->attribute("Software", "Sherd " SHERD_VERSION);
  if (options.dpi > 0) {
    spec->attribute("XResolution", static_cast<float>(options.dpi));
    spec->attribute("YResolution", static_cast<float>(options.dpi));
    spec->attribute("ResolutionUnit", "in");
  }
}

}  // namespace

std::uint8_t EncodeSrgb8(float linear) {
  static const SrgbSteps steps;
  if (!(linear > 0.0f)) return 0;
  if (linear >= 1.0f) return 255;
  std::size_t k = steps.code[static_cast<std::size_t>(linear * 4096.0f)];
  while (linear >= steps.begin[k + 1]) ++k;
  return static_cast<std::uint8_t>(k);
}

Background ParseBackground(const std::string& text) {
  Background background;
  if (text == "transparent") {
    background.transparent = true;
    return background;
  }
  const auto fail = [&]() -> InputError {
    return InputError("", "", "\"" + text + "\" is no background",
                      "give \"transparent\" or red,green,blue with values from 0 to 1");
  };
  float* const channels[] = {&background.srgb.x, &background.srgb.y, &background.srgb.z};
  const char* p = text.data();
  const char* const end = p + text.size();
  for (int i = 0; i < 3; ++i) {
    if (i > 0 && (p == end || *p++ != ',')) throw fail();
    const auto result = std::from_chars(p, end, *channels[i]);
    if (result.ec != std::errc() || !(*channels[i] >= 0 && *channels[i] <= 1)) throw fail();
    p = result.ptr;
  }
  if (p != end) throw fail();
  return background;
}

void Composite(const Background& background, Frame* frame) {
  if (background.transparent) return;
  const Pixel b = {LinearFromSrgb(background.srgb.x), LinearFromSrgb(background.srgb.y),
                   LinearFromSrgb(background.srgb.z), 1};
  for (Pixel& p : frame->color) {
    const float through = 1 - p.a;
    p = {p.r + b.r * through, p.g + b.g * through, p.b + b.b * through, 1};
  }
}

struct PictureWriter::Impl {
  std::string path;
  PictureOptions options;
  Format format;
  int width, height, channels;
  int rows_written = 0;
  std::unique_ptr<PictureFile> file;

  void CheckStrip(const Frame& strip) {
    if (strip.width != width || strip.height < 1 || rows_written + strip.height > height) {
      throw OutputError(path, "the strip does not fit the picture (a fault of the program)");
    }
  }
  // Converts pixel by pixel: convert(pixel, first channel out).
  template <class T, class Convert>
  void Write(const Frame& strip, const Convert& convert) {
    // In blocks of rows: the converted copy stays small.
    const int block = std::max(1, (1 << 20) / std::max(1, width));
    std::vector<T> buffer;
    for (int y = 0; y < strip.height; y += block) {
      const int rows = std::min(block, strip.height - y);
      const std::size_t n = static_cast<std::size_t>(rows) * static_cast<std::size_t>(width);
      buffer.resize(n * static_cast<std::size_t>(channels));
      const Pixel* in =
          strip.color.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
      T* out = buffer.data();
      for (std::size_t i = 0; i < n; ++i) {
        convert(in[i], out);
        out += channels;
      }
      file->WriteRows(buffer.data(), OIIO::BaseTypeFromC<T>::value, rows);
    }
    rows_written += strip.height;
  }
  void Finish() {
    if (rows_written != height) {
      throw OutputError(path, "rows are missing (a fault of the program)");
    }
    file->Finish();
  }
};

PictureWriter::PictureWriter(const std::string& path, int width, int height,
                             const PictureOptions& options)
    : impl_(std::make_unique<Impl>()) {
  const Format format = FormatOf(path);
  CheckSize(path, format, width, height);
  if (format == Format::kJpeg && options.alpha) {
    throw OutputError(path, "JPEG has no transparency; write a PNG or give a background");
  }
  if (format == Format::kJpeg && options.bits != 8) {
    throw OutputError(path, "JPEG has 8 bits a channel; write a PNG or a TIFF");
  }
  if (format != Format::kExr && options.bits != 8 && options.bits != 16) {
    throw OutputError(path, "PNG and TIFF have 8 or 16 bits a channel; write an EXR for more");
  }
  const int channels = options.alpha ? 4 : 3;
  const OIIO::TypeDesc type =
      format == Format::kExr
          ? (options.bits == 32 ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::HALF)
          : (options.bits == 16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8);
  OIIO::ImageSpec spec(width, height, channels, type);
  if (format != Format::kExr) {
    // We write straight alpha ourselves, in linear light.
    if (options.alpha) spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("oiio:ColorSpace", options.linear ? "Linear" : "sRGB");
  } else {
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("compression", "zip");
  }
  if (format == Format::kJpeg) {
    spec.attribute("Compression", "jpeg:95");
    spec.attribute("jpeg:subsampling", "4:4:4");
  }
  if (format == Format::kTiff) spec.attribute("compression", "zip");
  // zlib's default takes twice as long for a sixteenth less.
  if (format == Format::kPng) spec.attribute("png:compressionLevel", 4);
  AddMetadata(options, format, &spec);
  *impl_ = {path, options, format, width, height, channels, 0, nullptr};
  impl_->file = std::make_unique<PictureFile>(path, OiioName(format), spec);
}

PictureWriter::~PictureWriter() = default;
PictureWriter::PictureWriter(PictureWriter&&) noexcept = default;

void PictureWriter::WriteRows(const Frame& strip) {
  impl_->CheckStrip(strip);
  const bool alpha = impl_->options.alpha;
  const bool linear = impl_->options.linear;
  if (impl_->format == Format::kExr) {
    impl_->Write<float>(strip, [alpha](const Pixel& p, float* out) {
      out[0] = p.r;
      out[1] = p.g;
      out[2] = p.b;
      if (alpha) out[3] = p.a;
    });
  } else if (impl_->options.bits == 16) {
    impl_->Write<std::uint16_t>(strip, [alpha, linear](const Pixel& p, std::uint16_t* out) {
      const Pixel s = alpha ? Straight(p) : p;
      out[0] = Quantize16(linear ? s.r : SrgbFromLinear(s.r));
      out[1] = Quantize16(linear ? s.g : SrgbFromLinear(s.g));
      out[2] = Quantize16(linear ? s.b : SrgbFromLinear(s.b));
      if (alpha) out[3] = Quantize16(s.a);
    });
  } else {
    impl_->Write<std::uint8_t>(strip, [alpha, linear](const Pixel& p, std::uint8_t* out) {
      const Pixel s = alpha ? Straight(p) : p;
      out[0] = linear ? Quantize8(s.r) : EncodeSrgb8(s.r);
      out[1] = linear ? Quantize8(s.g) : EncodeSrgb8(s.g);
      out[2] = linear ? Quantize8(s.b) : EncodeSrgb8(s.b);
      if (alpha) out[3] = Quantize8(s.a);
    });
  }
}

void PictureWriter::Finish() { impl_->Finish(); }

DepthWriter::DepthWriter(const std::string& path, int width, int height)
    : impl_(std::make_unique<PictureWriter::Impl>()) {
  if (FormatOf(path) != Format::kExr) throw OutputError(path, "a depth image's name ends in .exr");
  CheckSize(path, Format::kExr, width, height);
  OIIO::ImageSpec spec(width, height, 1, OIIO::TypeDesc::FLOAT);
  spec.channelnames = {"Y"};
  spec.attribute("oiio:ColorSpace", "Linear");
  spec.attribute("compression", "zip");
  spec.attribute("Software", "Sherd " SHERD_VERSION);
  spec.attribute("ImageDescription", "distance along the ray, world units; 0: nothing is hit");
  *impl_ = {path, {}, Format::kExr, width, height, 1, 0, nullptr};
  impl_->file = std::make_unique<PictureFile>(path, "openexr", spec);
}

DepthWriter::~DepthWriter() = default;
DepthWriter::DepthWriter(DepthWriter&&) noexcept = default;

void DepthWriter::WriteRows(const Frame& strip) {
  impl_->CheckStrip(strip);
  if (strip.depth.size() != strip.color.size()) {
    throw OutputError(impl_->path, "the frame has no depth (a fault of the program)");
  }
  impl_->file->WriteRows(strip.depth.data(), OIIO::TypeDesc::FLOAT, strip.height);
  impl_->rows_written += strip.height;
}

void DepthWriter::Finish() { impl_->Finish(); }

void WritePicture(const std::string& path, const Frame& frame, const PictureOptions& options) {
  PictureWriter writer(path, frame.width, frame.height, options);
  writer.WriteRows(frame);
  writer.Finish();
}

void WriteDepth(const std::string& path, const Frame& frame) {
  DepthWriter writer(path, frame.width, frame.height);
  writer.WriteRows(frame);
  writer.Finish();
}

}  // namespace sherd
