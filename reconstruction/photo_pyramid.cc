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
  explicit RowHalver(int width) : width_(width), sums_(static_cast<std::size_t>(width + 1) / 2) {}

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
      w = (w + 1) / 2;
      h = (h + 1) / 2;
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

PhotoPyramid PhotoPyramid::Read(const std::string& path, int finest) {
  PhotoFile file(path);
  PhotoPyramid out;
  out.width_ = file.width();
  out.height_ = file.height();
  PyramidBuilder builder(out.width_, out.height_, std::max(0, finest), &out.levels_);
  out.finest_ = builder.finest();
  std::vector<Vec3f> linear(static_cast<std::size_t>(out.width_));
  file.ReadRows([&](const Vec3f* row) {
    std::copy_n(row, linear.size(), linear.begin());
    builder.AddRow(linear);
  });
  builder.Finish();
  return out;
}

std::size_t PhotoPyramid::MemoryBytes() const {
  std::size_t bytes = 0;
  for (const PhotoLevel& level : levels_) bytes += level.pixels.capacity() * sizeof(Rgb8);
  return bytes;
}

std::size_t PhotoPyramid::BytesFor(int width, int height, int finest) {
  std::size_t bytes = 0;
  for (int w = width, h = height, level = 0; w > 1 || h > 1; ++level) {
    if (level >= finest) bytes += static_cast<std::size_t>(w) * h * sizeof(Rgb8);
    w = (w + 1) / 2;
    h = (h + 1) / 2;
  }
  return bytes + sizeof(Rgb8);
}

Vec3f PhotoPyramid::SampleLevel(const PhotoLevel& level, float x, float y) const {
  const float* const table = SrgbToLinearTable();
  x = std::clamp(x - 0.5f, 0.0f, static_cast<float>(level.width - 1));
  y = std::clamp(y - 0.5f, 0.0f, static_cast<float>(level.height - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, level.width - 1), y1 = std::min(y0 + 1, level.height - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const auto at = [&](int px, int py) {
    const Rgb8 c = level.pixels[static_cast<std::size_t>(py) * level.width + px];
    return Vec3f{table[c.r], table[c.g], table[c.b]};
  };
  const Vec3f top = at(x0, y0) * (1 - fx) + at(x1, y0) * fx;
  const Vec3f bottom = at(x0, y1) * (1 - fx) + at(x1, y1) * fx;
  return top * (1 - fy) + bottom * fy;
}

Vec3f PhotoPyramid::Sample(float x, float y, float level) const {
  const float last = static_cast<float>(levels_.size() - 1);
  const float l = std::clamp(level - static_cast<float>(finest_), 0.0f, last);
  const auto lower = static_cast<std::size_t>(l);
  const float f = l - static_cast<float>(lower);
  const auto at = [&](std::size_t i) {
    const float scale = std::ldexp(1.0f, -(finest_ + static_cast<int>(i)));
    return SampleLevel(levels_[i], x * scale, y * scale);
  };
  const Vec3f a = at(lower);
  return f > 0 && lower + 1 < levels_.size() ? a * (1 - f) + at(lower + 1) * f : a;
}

Vec3f PhotoPyramid::SampleSharply(float x, float y, int level) const {
  const int i = std::clamp(level - finest_, 0, static_cast<int>(levels_.size()) - 1);
  const PhotoLevel& pixels = levels_[static_cast<std::size_t>(i)];
  const float scale = std::ldexp(1.0f, -(finest_ + i));
  const float* const table = SrgbToLinearTable();
  x = std::clamp(x * scale - 0.5f, 0.0f, static_cast<float>(pixels.width - 1));
  y = std::clamp(y * scale - 0.5f, 0.0f, static_cast<float>(pixels.height - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const auto weights = [](float t, float* w) {
    w[0] = t * (-0.5f + t * (1 - 0.5f * t));
    w[1] = 1 + t * t * (-2.5f + 1.5f * t);
    w[2] = t * (0.5f + t * (2 - 1.5f * t));
    w[3] = t * t * (-0.5f + 0.5f * t);
  };
  float wx[4], wy[4];
  weights(x - static_cast<float>(x0), wx);
  weights(y - static_cast<float>(y0), wy);
  Vec3f sum{};
  for (int j = 0; j < 4; ++j) {
    const int py = std::clamp(y0 + j - 1, 0, pixels.height - 1);
    for (int k = 0; k < 4; ++k) {
      const int px = std::clamp(x0 + k - 1, 0, pixels.width - 1);
      const Rgb8 c = pixels.pixels[static_cast<std::size_t>(py) * pixels.width + px];
      sum += Vec3f{table[c.r], table[c.g], table[c.b]} * (wx[k] * wy[j]);
    }
  }
  return {std::max(sum.x, 0.0f), std::max(sum.y, 0.0f), std::max(sum.z, 0.0f)};
}

}  // namespace sherd
