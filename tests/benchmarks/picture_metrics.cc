#include "tests/benchmarks/picture_metrics.h"

#include <algorithm>
#include <cmath>

#include "metaball/parallel.h"

namespace sherd::benchmarks {
namespace {

using Plane = std::vector<float>;

// Gaussian blur over the pixels of the mask alone (normalised convolution): 0 outside of it.
class MaskedBlur {
 public:
  MaskedBlur(const std::vector<char>& mask, int width, int height, double sigma, int radius)
      : width_(width), height_(height), radius_(radius), mask_(mask) {
    for (int i = -radius; i <= radius; ++i) {
      kernel_.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    }
    Plane ones(mask.size());
    for (std::size_t i = 0; i < mask.size(); ++i) ones[i] = mask[i] ? 1.0f : 0.0f;
    norm_ = Convolve(ones);
  }

  Plane operator()(const Plane& plane) const {
    Plane in(plane.size());
    for (std::size_t i = 0; i < plane.size(); ++i) in[i] = mask_[i] ? plane[i] : 0.0f;
    Plane out = Convolve(in);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = mask_[i] ? out[i] / norm_[i] : 0.0f;
    return out;
  }

 private:
  Plane Convolve(const Plane& in) const {
    Plane rows(in.size()), out(in.size());
    ParallelFor(height_, 0, [&](std::int64_t y, int) {
      for (int x = 0; x < width_; ++x) {
        float sum = 0;
        for (int k = std::max(-radius_, -x); k <= std::min(radius_, width_ - 1 - x); ++k) {
          sum += kernel_[k + radius_] * in[y * width_ + x + k];
        }
        rows[y * width_ + x] = sum;
      }
    });
    ParallelFor(height_, 0, [&](std::int64_t y64, int) {
      const int y = static_cast<int>(y64);
      for (int k = std::max(-radius_, -y); k <= std::min(radius_, height_ - 1 - y); ++k) {
        const float* const from = &rows[static_cast<std::size_t>(y + k) * width_];
        float* const to = &out[static_cast<std::size_t>(y) * width_];
        for (int x = 0; x < width_; ++x) to[x] += kernel_[k + radius_] * from[x];
      }
    });
    return out;
  }

  int width_, height_, radius_;
  const std::vector<char>& mask_;
  Plane kernel_, norm_;
};

Plane LumaOf(const Picture& picture, const std::array<double, 3>& gain) {
  Plane luma;
  luma.reserve(picture.pixels.size());
  for (const Vec3f& c : picture.pixels) {
    luma.push_back(static_cast<float>(0.2126 * gain[0] * c.x + 0.7152 * gain[1] * c.y +
                                      0.0722 * gain[2] * c.z));
  }
  return luma;
}

Plane Product(const Plane& a, const Plane& b) {
  Plane out(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) out[i] = a[i] * b[i];
  return out;
}

double Ssim(const Plane& a, const Plane& b, const std::vector<char>& mask, int width, int height) {
  constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;
  const MaskedBlur blur(mask, width, height, 1.5, 5);
  const Plane ma = blur(a), mb = blur(b), aa = blur(Product(a, a)), bb = blur(Product(b, b)),
              ab = blur(Product(a, b));
  double sum = 0;
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (!mask[i]) continue;
    const double x = ma[i], y = mb[i];
    const double xx = aa[i] - x * x, yy = bb[i] - y * y, xy = ab[i] - x * y;
    sum += (2 * x * y + kC1) * (2 * xy + kC2) / ((x * x + y * y + kC1) * (xx + yy + kC2));
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

double Correlation(const Plane& a, const Plane& b, const std::vector<char>& mask) {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (!mask[i]) continue;
    n += 1;
    sa += a[i];
    sb += b[i];
    saa += double(a[i]) * a[i];
    sbb += double(b[i]) * b[i];
    sab += double(a[i]) * b[i];
  }
  const double va = saa - sa * sa / n, vb = sbb - sb * sb / n;
  return n > 0 && va > 0 && vb > 0 ? (sab - sa * sb / n) / std::sqrt(va * vb) : 0;
}

Plane HighPass(const Plane& luma, const MaskedBlur& blur) {
  Plane out = blur(luma);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = luma[i] - out[i];
  return out;
}

}  // namespace

PictureScore Compare(const Picture& picture, const Picture& reference,
                     const std::vector<char>& mask) {
  PictureScore score;
  std::array<double, 3> pr{}, pp{};
  const auto channel = [](const Vec3f& c, int k) -> double {
    return k == 0 ? c.x : k == 1 ? c.y : c.z;
  };
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (!mask[i]) continue;
    ++score.pixels;
    for (int k = 0; k < 3; ++k) {
      const double p = channel(picture.pixels[i], k), r = channel(reference.pixels[i], k);
      pr[k] += p * r;
      pp[k] += p * p;
    }
  }
  for (int k = 0; k < 3; ++k) score.gain[k] = pp[k] > 0 ? pr[k] / pp[k] : 1;
  double squares = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (!mask[i]) continue;
    for (int k = 0; k < 3; ++k) {
      const double d =
          score.gain[k] * channel(picture.pixels[i], k) - channel(reference.pixels[i], k);
      squares += d * d;
    }
  }
  if (score.pixels == 0) return score;
  score.psnr_db =
      -10 * std::log10(std::max(1e-12, squares / (3.0 * static_cast<double>(score.pixels))));
  const Plane a = LumaOf(picture, score.gain), b = LumaOf(reference, {1, 1, 1});
  score.ssim = Ssim(a, b, mask, picture.width, picture.height);
  for (std::size_t s = 0; s < kHighPassSigma.size(); ++s) {
    const MaskedBlur blur(mask, picture.width, picture.height, kHighPassSigma[s],
                          static_cast<int>(std::ceil(3 * kHighPassSigma[s])));
    score.high_pass[s] = Correlation(HighPass(a, blur), HighPass(b, blur), mask);
  }
  return score;
}

namespace {

// Pixels all of whose square of 2 radius + 1 is set; `beyond` stands for what lies outside.
std::vector<char> AllAround(const std::vector<char>& mask, int width, int height, int radius,
                            bool beyond) {
  const auto along = [&](const std::vector<char>& in, int dx, int dy) {
    std::vector<char> out(in.size());
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        char all = 1;
        for (int k = -radius; all && k <= radius; ++k) {
          const int u = x + k * dx, v = y + k * dy;
          all = u < 0 || v < 0 || u >= width || v >= height
                    ? beyond
                    : in[static_cast<std::size_t>(v) * width + u];
        }
        out[static_cast<std::size_t>(y) * width + x] = all;
      }
    }
    return out;
  };
  return along(along(mask, 1, 0), 0, 1);
}

}  // namespace

std::vector<char> Eroded(const std::vector<char>& mask, int width, int height, int radius) {
  return AllAround(mask, width, height, radius, false);
}

std::vector<char> Dilated(std::vector<char> mask, int width, int height, int radius) {
  for (char& m : mask) m = !m;
  mask = AllAround(mask, width, height, radius, true);
  for (char& m : mask) m = !m;
  return mask;
}

}  // namespace sherd::benchmarks
