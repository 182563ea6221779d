#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "app/project/picture.h"
#include "metaball/error.h"

namespace sherd {
namespace {

// A picture read row by row as straight RGBA in 8-bit units.
class RowReader {
 public:
  explicit RowReader(const std::string& path) : path_(path) {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    input_ = OIIO::ImageInput::open(path, &config);
    if (!input_) {
      std::string reason = OIIO::geterror();
      reason = reason.substr(0, reason.find('\n'));
      throw InputError(
          path, "",
          "cannot be read as a picture" + (reason.empty() ? std::string() : " (" + reason + ")"));
    }
    channels_ = input_->spec().nchannels;
    if (channels_ < 1 || channels_ > 4) {
      throw InputError(path, "", "has " + std::to_string(channels_) + " channels",
                       "give a picture of 1 to 4");
    }
    raw_.resize(static_cast<std::size_t>(width()) * static_cast<std::size_t>(channels_));
  }

  int width() const { return input_->spec().width; }
  int height() const { return input_->spec().height; }
  bool has_alpha() const { return channels_ == 2 || channels_ == 4; }

  void Read(int y, std::vector<std::array<double, 4>>* row) {
    if (!input_->read_scanlines(0, 0, y + input_->spec().y, y + input_->spec().y + 1, 0, 0,
                                channels_, OIIO::TypeDesc::FLOAT, raw_.data())) {
      input_->geterror();
      throw InputError(path_, "row " + std::to_string(y), "the picture's data ends or is damaged");
    }
    row->resize(static_cast<std::size_t>(width()));
    const float* in = raw_.data();
    for (auto& out : *row) {
      const bool gray = channels_ < 3;
      const int alpha = channels_ == 2 ? 1 : channels_ == 4 ? 3 : -1;
      for (int c = 0; c < 3; ++c) out[static_cast<std::size_t>(c)] = 255.0 * in[gray ? 0 : c];
      out[3] = alpha < 0 ? 255.0 : 255.0 * in[alpha];
      in += channels_;
    }
  }

 private:
  std::string path_;
  std::unique_ptr<OIIO::ImageInput> input_;
  int channels_ = 0;
  std::vector<float> raw_;
};

}  // namespace

PictureDifference ComparePictures(const std::string& path_a, const std::string& path_b) {
  RowReader a(path_a), b(path_b);
  if (a.width() != b.width() || a.height() != b.height()) {
    throw InputError(path_a, "",
                     "is " + std::to_string(a.width()) + " x " + std::to_string(a.height()) +
                         " pixels, but " + path_b + " is " + std::to_string(b.width()) + " x " +
                         std::to_string(b.height()),
                     "compare pictures of one size");
  }
  std::vector<std::array<double, 4>> row_a, row_b;
  double sum = 0;
  std::uint64_t off = 0;
  PictureDifference result;
  const std::size_t channels = a.has_alpha() || b.has_alpha() ? 4 : 3;
  for (int y = 0; y < a.height(); ++y) {
    a.Read(y, &row_a);
    b.Read(y, &row_b);
    for (std::size_t x = 0; x < row_a.size(); ++x) {
      double largest = 0;
      for (std::size_t c = 0; c < channels; ++c) {
        double d = std::abs(row_a[x][c] - row_b[x][c]);
        // Not a number on one side alone is as different as can be.
        if (std::isnan(d)) d = std::isnan(row_a[x][c]) && std::isnan(row_b[x][c]) ? 0 : 255;
        sum += d * d;
        largest = std::max(largest, d);
      }
      // Half a thousandth: the rounding of byte values read as floats is no difference.
      if (largest > 8 + 5e-4) ++off;
      result.largest = std::max(result.largest, largest);
    }
  }
  const double pixels = static_cast<double>(a.width()) * a.height();
  result.rms = std::sqrt(sum / (static_cast<double>(channels) * pixels));
  result.share_off_by_8 = static_cast<double>(off) / pixels;
  return result;
}

}  // namespace sherd
