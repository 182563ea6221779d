#include "reconstruction/photo_pyramid.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <mutex>

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
    for (int x = 0; x < width_; ++x) sums_[static_cast<std::size_t>(x / 2)] += row[x];
    ++rows_;
  }
  bool complete() const { return rows_ == 2; }
  bool empty() const { return rows_ == 0; }
  // The averaged row; starts the next pair.
  const std::vector<Vec3f>& Take() {
    for (int x = 0; x < static_cast<int>(sums_.size()); ++x) {
      const int columns = std::min(2, width_ - 2 * x);
      out_.resize(sums_.size());
      out_[x] = sums_[x] * (1.0f / static_cast<float>(rows_ * columns));
    }
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
    for (int w = width, h = height, level = 0;; ++level) {
      if (level >= finest) {
        levels->push_back({w, h, {}});
        levels->back().pixels.reserve(static_cast<std::size_t>(w) * h);
      }
      if (w == 1 && h == 1) break;
      halvers_.emplace_back(w);
      w = HalvedSide(w);
      h = HalvedSide(h);
    }
    if (levels->empty()) {  // coarser than a single pixel was asked for
      finest_ = static_cast<int>(halvers_.size());
      levels->push_back({1, 1, {}});
    }
  }
  int finest() const { return finest_; }

  void AddRow(const std::vector<Vec3f>& row, std::size_t level = 0) {
    if (static_cast<int>(level) >= finest_) {
      PhotoLevel& kept = (*levels_)[level - static_cast<std::size_t>(finest_)];
      for (const Vec3f& c : row) {
        kept.pixels.push_back({EncodeLinear(c.x), EncodeLinear(c.y), EncodeLinear(c.z)});
      }
    }
    if (level >= halvers_.size()) return;
    halvers_[level].Add(row.data());
    if (halvers_[level].complete()) AddRow(halvers_[level].Take(), level + 1);
  }
  // The rows left over where a height is odd.
  void Finish() {
    for (std::size_t level = 0; level < halvers_.size(); ++level) {
      if (!halvers_[level].empty()) AddRow(halvers_[level].Take(), level + 1);
    }
  }

 private:
  int finest_;
  std::vector<PhotoLevel>* levels_;
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
  std::vector<Vec3f> linear(static_cast<std::size_t>(file.width()));
  file.ReadRows([&](const Vec3f* row) {
    std::copy_n(row, linear.size(), linear.begin());
    builder.AddRow(linear);
  });
  builder.Finish();
  return {file.width(), file.height(), builder.finest(), std::move(levels)};
}

}  // namespace sherd
