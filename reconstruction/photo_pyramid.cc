#include "reconstruction/photo_pyramid.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "metaball/error.h"
#include "reconstruction/photo_file.h"

namespace sherd {
namespace {

// Halves a row pair into `out`: 2 x 2 averages in linear light.
class RowHalver {
 public:
  explicit RowHalver(int width)
      : width_(width), sums_(static_cast<std::size_t>(HalvedSide(width))) {}

  void Add(const Vec3f* row) {
    const int pairs = width_ / 2;
    for (int x = 0; x < pairs; ++x) sums_[x] += row[2 * x] + row[2 * x + 1];
    if (width_ % 2) sums_[pairs] += row[width_ - 1];
    ++rows_;
  }
  bool complete() const { return rows_ == 2; }
  bool empty() const { return rows_ == 0; }
  // The averaged row; starts the next pair.
  const std::vector<Vec3f>& Take() {
    out_.resize(sums_.size());
    const float whole = 1.0f / static_cast<float>(rows_ * std::min(2, width_));
    for (std::size_t x = 0; x < sums_.size(); ++x) out_[x] = sums_[x] * whole;
    if (width_ % 2) out_.back() = sums_.back() * (1.0f / static_cast<float>(rows_));
    std::fill(sums_.begin(), sums_.end(), Vec3f{});
    rows_ = 0;
    return out_;
  }

 private:
  int width_, rows_ = 0;
  std::vector<Vec3f> sums_, out_;
};

// The chain of halvings a photograph's rows run through; rows of level `finest` and coarser stay.
class PyramidBuilder {
 public:
  PyramidBuilder(int width, int height, int finest, std::vector<PhotoLevel>* levels)
      : finest_(finest), levels_(levels) {
    const std::vector<LevelSize> sizes = LevelSizes(width, height);
    // Where coarser than a single pixel was asked for, that is kept.
    finest_ = std::min(finest_, static_cast<int>(sizes.size()) - 1);
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      if (static_cast<int>(k) >= finest_) levels->push_back(Empty(sizes[k].width, sizes[k].height));
      if (k + 1 < sizes.size()) halvers_.emplace_back(sizes[k].width);
    }
    filled_.assign(levels->size(), 0);
  }
  int finest() const { return finest_; }

  // encoded: the row of level 0 in sRGB bytes, null where it has to be made.
  void AddRow(const Vec3f* row, const std::uint8_t* encoded = nullptr, std::size_t level = 0) {
    if (static_cast<int>(level) >= finest_) {
      const std::size_t k = level - static_cast<std::size_t>(finest_);
      PhotoLevel& kept = (*levels_)[k];
      const auto width = static_cast<std::size_t>(kept.width);
      Rgb8* const out = kept.pixels.data() + filled_[k]++ * width;
      if (encoded) {
        std::memcpy(static_cast<void*>(out), encoded, width * sizeof(Rgb8));
      } else {
        for (std::size_t x = 0; x < width; ++x) {
          out[x] = {EncodeLinear(row[x].x), EncodeLinear(row[x].y), EncodeLinear(row[x].z)};
        }
      }
    }
    if (level >= halvers_.size()) return;
    halvers_[level].Add(row);
    if (halvers_[level].complete()) AddRow(halvers_[level].Take().data(), nullptr, level + 1);
  }
  // The rows left over where a height is odd.
  void Finish() {
    for (std::size_t level = 0; level < halvers_.size(); ++level) {
      if (!halvers_[level].empty()) AddRow(halvers_[level].Take().data(), nullptr, level + 1);
    }
  }

 private:
  static PhotoLevel Empty(int width, int height) {
    return {width, height, std::vector<Rgb8>(static_cast<std::size_t>(width) * height)};
  }

  int finest_;
  std::vector<PhotoLevel>* levels_;
  std::vector<std::size_t> filled_;  // rows of each
  std::vector<RowHalver> halvers_;
};

}  // namespace

std::uint8_t EncodeLinear(float v) {
  // A table over the square root: the curve is steep near 0, the square root spreads it.
  constexpr int kSize = 4096;
  static const std::vector<std::uint8_t> table = [] {
    std::vector<std::uint8_t> t(kSize + 1);
    for (int i = 0; i <= kSize; ++i) {
      const float root = static_cast<float>(i) / kSize;
      t[static_cast<std::size_t>(i)] = Quantize8(SrgbFromLinear(root * root));
    }
    return t;
  }();
  if (!(v > 0)) return 0;
  if (v >= 1) return 255;
  return table[static_cast<std::size_t>(std::sqrt(v) * kSize + 0.5f)];
}

PhotoPyramid ReadPhotoPyramid(const std::string& path, int finest) {
  PhotoFile file(path);
  std::vector<PhotoLevel> levels;
  PyramidBuilder builder(file.width(), file.height(), std::max(0, finest), &levels);
  file.ReadRows(
      [&](const Vec3f* row, const std::uint8_t* encoded) { builder.AddRow(row, encoded); });
  builder.Finish();
  return {file.width(), file.height(), builder.finest(), std::move(levels)};
}

}  // namespace sherd
