#include "reconstruction/photo_file.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <mutex>
#include <vector>

#include "metaball/color.h"
#include "metaball/error.h"

namespace sherd {

struct PhotoFile::Impl {
  std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;  // outlives the input
  std::unique_ptr<OIIO::ImageInput> input;
  bool linear = false;  // float pixels without an sRGB curve
};

PhotoFile::PhotoFile(const std::string& path) : impl_(std::make_unique<Impl>()), path_(path) {
  Open(path);
}

PhotoFile::PhotoFile(const std::string& name, const std::vector<std::uint8_t>& bytes)
    : impl_(std::make_unique<Impl>()), path_(name) {
  impl_->memory = std::make_unique<OIIO::Filesystem::IOMemReader>(bytes.data(), bytes.size());
  // By its first bytes: OpenImageIO asks the plugin of the name's extension first.
  const bool png = bytes.size() > 3 && bytes[1] == 'P' && bytes[2] == 'N' && bytes[3] == 'G';
  Open(png ? "texture.png" : "texture.jpg");
}

void PhotoFile::Open(const std::string& what) {
  static std::once_flag once;
  std::call_once(once, [] {
    // A header that lies about its size must not take the memory: no photograph is larger.
    OIIO::attribute("limits:imagesize_MB", 8192);
    OIIO::attribute("limits:channels", 64);
  });
  impl_->input = OIIO::ImageInput::open(what, nullptr, impl_->memory.get());
  if (!impl_->input) {
    std::string reason = OIIO::geterror();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    throw InputError(
        path_, "",
        "is no image that can be read" + (reason.empty() ? std::string() : " (" + reason + ")"));
  }
  const OIIO::ImageSpec& spec = impl_->input->spec();
  width_ = spec.width;
  height_ = spec.height;
  if (width_ < 1 || height_ < 1 || spec.nchannels < 1) {
    throw InputError(path_, "", "the image has no pixels");
  }
  impl_->linear = spec.format.is_floating_point() &&
                  spec.get_string_attribute("oiio:ColorSpace", "Linear") != "sRGB";
}

PhotoFile::~PhotoFile() = default;

void PhotoFile::ReadRows(
    const std::function<void(const Vec3f* row, const std::uint8_t* encoded)>& take) {
  const OIIO::ImageSpec spec = impl_->input->spec();
  const int channels = spec.nchannels >= 3 ? 3 : 1;
  const int strip = spec.tile_height > 0 ? spec.tile_height : 64;
  const auto row_values = static_cast<std::size_t>(width_) * channels;
  std::vector<float> floats;
  std::vector<std::uint8_t> bytes;
  if (impl_->linear) {
    floats.resize(row_values * strip);
  } else {
    bytes.resize(row_values * strip);
  }
  std::vector<Vec3f> row(static_cast<std::size_t>(width_));
  const float* const table = SrgbToLinearTable();
  for (int y = 0; y < height_; y += strip) {
    const int rows = std::min(strip, height_ - y);
    void* const data = impl_->linear ? static_cast<void*>(floats.data()) : bytes.data();
    const OIIO::TypeDesc type = impl_->linear ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
    const int first = spec.y + y;
    const bool ok =
        spec.tile_width > 0
            ? impl_->input->read_tiles(0, 0, spec.x, spec.x + width_, first, first + rows, spec.z,
                                       spec.z + 1, 0, channels, type, data)
            : impl_->input->read_scanlines(0, 0, first, first + rows, spec.z, 0, channels, type,
                                           data);
    if (!ok) {
      std::string reason = impl_->input->geterror();
      std::replace(reason.begin(), reason.end(), '\n', ' ');
      throw InputError(path_, "row " + std::to_string(y), "the image is damaged (" + reason + ")",
                       "copy it again");
    }
    for (int r = 0; r < rows; ++r) {
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = r * row_values + static_cast<std::size_t>(x) * channels;
        const std::size_t g = i + (channels > 1), b = i + (channels > 1 ? 2 : 0);
        row[static_cast<std::size_t>(x)] =
            impl_->linear ? Vec3f{floats[i], floats[g], floats[b]}
                          : Vec3f{table[bytes[i]], table[bytes[g]], table[bytes[b]]};
      }
      take(row.data(), impl_->linear || channels < 3 ? nullptr : &bytes[r * row_values]);
    }
  }
}

}  // namespace sherd
