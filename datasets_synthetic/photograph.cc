#include "datasets_synthetic/photograph.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "datasets_synthetic/random.h"
#include "metaball/color.h"
#include "metaball/error.h"
#include "metaball/parallel.h"

namespace sherd::synthetic {
namespace {

constexpr int kStripRows = 16;

// One sample of the picture.
struct Sample {
  Vec3f radiance{};
  float depth = 0;  // 0: sky
  std::uint32_t part = 0;
  Vec3f normal{};
  float cosine = 1;
};

// Eight places in a pixel, no two in a row or column (the 8-rooks pattern of multisampling).
constexpr std::array<std::array<double, 2>, 8> kRooks{{{0.5625, 0.3125},
                                                       {0.4375, 0.6875},
                                                       {0.8125, 0.5625},
                                                       {0.3125, 0.1875},
                                                       {0.1875, 0.8125},
                                                       {0.0625, 0.4375},
                                                       {0.6875, 0.9375},
                                                       {0.9375, 0.0625}}};

class Photographer {
 public:
  Photographer(const TrenchScene& scene, const Shot& shot, const Lens& lens)
      : scene_(scene), shot_(shot), lens_(lens) {}

  // `share`: the side of the sample's square, in pixels.
  Sample At(double x, double y, double share) const {
    double u, v;
    lens_.Unproject(x, y, &u, &v);
    const RayD ray = shot_.RayOf(u, v);
    Sample s;
    SceneHit hit;
    if (!scene_.Intersect(ray, &hit)) {
      s.radiance = scene_.Sky(ray.direction);
      return s;
    }
    const double depth = Dot(hit.point - shot_.eye, shot_.forward);
    const double cosine = std::max(0.05, -Dot(hit.smooth_normal, ray.direction));
    // A pixel is longer on the surface than wide; the texture is limited to between the two.
    const double footprint = share * depth / lens_.fx / std::sqrt(cosine);
    s.radiance = scene_.Radiance(hit, footprint);
    s.depth = static_cast<float>(depth);
    s.part = scene_.mesh().part[hit.mesh.triangle] + 1u;
    s.normal = hit.smooth_normal.cast<float>();
    s.cosine = static_cast<float>(cosine);
    return s;
  }

  // Whether the pixel shows an edge, or a surface so oblique that one sample does not do.
  static bool NeedsMore(const Sample& a, const Sample& b) {
    if (a.part != b.part) return true;
    if (a.part == 0) return false;
    if (Dot(a.normal, b.normal) < 0.90f) return true;
    const float slack = 0.02f / std::max(0.1f, std::min(a.cosine, b.cosine));
    if (std::abs(a.depth - b.depth) > slack * std::min(a.depth, b.depth)) return true;
    // A step of brightness that the eye and a feature detector would see as jagged.
    const float la = a.radiance.y, lb = b.radiance.y;
    return std::abs(la - lb) > 0.55f * (la + lb) * 0.5f + 0.02f;
  }

  Vec3f Supersampled(int x, int y) const {
    Vec3f sum{};
    for (const auto& at : kRooks) {
      sum += Bounded(At(x + at[0], y + at[1], 0.6).radiance);
    }
    return sum * (1.0f / static_cast<float>(kRooks.size()));
  }
  static Vec3f Bounded(const Vec3f& v) {
    return {std::min(v.x, 1.5f), std::min(v.y, 1.5f), std::min(v.z, 1.5f)};
  }

 private:
  const TrenchScene& scene_;
  const Shot& shot_;
  const Lens& lens_;
};

}  // namespace

Vec3f Develop(const Vec3f& radiance, float exposure) {
  const auto curve = [exposure](float v) {
    v *= exposure;
    if (v > 0.7f) v = 0.7f + 0.3f * (1.0f - std::exp((0.7f - v) / 0.3f));
    return SrgbFromLinear(v);
  };
  return {curve(radiance.x), curve(radiance.y), curve(radiance.z)};
}

Picture TakePhotograph(const TrenchScene& scene, const Shot& shot, const Lens& lens,
                       const PhotographOptions& options, const Control& control) {
  Picture picture;
  picture.width = lens.width;
  picture.height = lens.height;
  const auto width = static_cast<std::size_t>(lens.width);
  picture.rgb.resize(3 * width * static_cast<std::size_t>(lens.height));
  const Photographer photographer(scene, shot, lens);
  const int strips = (lens.height + kStripRows - 1) / kStripRows;
  ParallelFor(strips, options.threads, [&](std::int64_t strip, int) {
    const int y_begin = static_cast<int>(strip) * kStripRows;
    const int y_end = std::min(lens.height, y_begin + kStripRows);
    // One sample a pixel first, with the row below, to find the edges.
    const int rows = std::min(lens.height, y_end + 1) - y_begin;
    std::vector<Sample> samples(width * static_cast<std::size_t>(rows));
    for (int r = 0; r < rows; ++r) {
      control.ThrowIfStopped();
      for (std::size_t x = 0; x < width; ++x) {
        samples[static_cast<std::size_t>(r) * width + x] =
            photographer.At(static_cast<double>(x) + 0.5, y_begin + r + 0.5, 1.0);
      }
    }
    std::vector<bool> more(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const auto compare = [&](std::size_t j) {
        if (Photographer::NeedsMore(samples[i], samples[j])) more[i] = more[j] = true;
      };
      if (i % width + 1 < width) compare(i + 1);
      if (i + width < samples.size()) compare(i + width);
      if (samples[i].part != 0 && samples[i].cosine < 0.25f) more[i] = true;
    }
    for (int y = y_begin; y < y_end; ++y) {
      control.ThrowIfStopped();
      for (std::size_t x = 0; x < width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y - y_begin) * width + x;
        const Vec3f radiance =
            more[i] ? photographer.Supersampled(static_cast<int>(x), y) : samples[i].radiance;
        const Vec3f srgb = Develop(radiance, shot.exposure);
        const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
        Rng rng(HashOf(options.seed, shot.image_id, pixel));
        const float* value = &srgb.x;
        for (std::size_t c = 0; c < 3; ++c) {
          const double noise =
              options.sensor_noise > 0 ? options.sensor_noise / 255.0 * rng.Gaussian() : 0.0;
          picture.rgb[3 * pixel + c] = Quantize8(value[c] + static_cast<float>(noise));
        }
      }
    }
  });
  return picture;
}

Picture Undistort(const Picture& picture, const Lens& lens, const Lens& pinhole, int threads) {
  if (!lens.distorted() && pinhole.width == picture.width && pinhole.height == picture.height) {
    return picture;
  }
  Picture out;
  out.width = pinhole.width;
  out.height = pinhole.height;
  out.rgb.resize(3 * static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  const auto weights = [](double t) {
    return std::array<float, 4>{static_cast<float>(t * (-0.5 + t * (1.0 - 0.5 * t))),
                                static_cast<float>(1.0 + t * t * (-2.5 + 1.5 * t)),
                                static_cast<float>(t * (0.5 + t * (2.0 - 1.5 * t))),
                                static_cast<float>(t * t * (-0.5 + 0.5 * t))};
  };
  ParallelFor(out.height, threads, [&](std::int64_t y, int) {
    for (int x = 0; x < out.width; ++x) {
      double sx = 0, sy = 0;
      const double u = (x + 0.5 - pinhole.cx) / pinhole.fx;
      const double v = (static_cast<double>(y) + 0.5 - pinhole.cy) / pinhole.fy;
      // The picture was cut so that its border lies in the source; a rounding beyond is clamped.
      if (!lens.Project(u, v, &sx, &sy)) continue;
      const int ix = static_cast<int>(std::floor(sx - 0.5));
      const int iy = static_cast<int>(std::floor(sy - 0.5));
      const auto wx = weights(sx - 0.5 - ix), wy = weights(sy - 0.5 - iy);
      float sum[3] = {0, 0, 0};
      for (int j = 0; j < 4; ++j) {
        const int row = std::clamp(iy + j - 1, 0, picture.height - 1);
        for (int i = 0; i < 4; ++i) {
          const int column = std::clamp(ix + i - 1, 0, picture.width - 1);
          const float w = wx[static_cast<std::size_t>(i)] * wy[static_cast<std::size_t>(j)];
          const std::uint8_t* p = &picture.rgb[3 * (static_cast<std::size_t>(row) *
                                                        static_cast<std::size_t>(picture.width) +
                                                    static_cast<std::size_t>(column))];
          for (int c = 0; c < 3; ++c) sum[c] += w * static_cast<float>(p[c]);
        }
      }
      std::uint8_t* to =
          &out.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width) +
                        static_cast<std::size_t>(x))];
      for (int c = 0; c < 3; ++c) to[c] = Quantize8(sum[c] * (1.0f / 255.0f));
    }
  });
  return out;
}

void WriteJpeg(const std::string& path, const Picture& picture, const Shot& shot, int quality) {
  std::unique_ptr<OIIO::ImageOutput> file = OIIO::ImageOutput::create(path);
  if (!file) throw OutputError(path, "cannot write JPEG files: " + OIIO::geterror());
  OIIO::ImageSpec spec(picture.width, picture.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Compression", "jpeg:" + std::to_string(quality));
  spec.attribute("jpeg:subsampling", "4:4:4");
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("Make", "Sherd");
  spec.attribute("Model", "Synthetic full frame");
  spec.attribute("Software", "sherd-synthetic");
  spec.attribute("DateTime", "2024:06:21 10:30:00");
  spec.attribute("Exif:FocalLength", static_cast<float>(shot.focal_35mm));
  spec.attribute("Exif:FocalLengthIn35mmFilm", static_cast<int>(shot.focal_35mm));
  if (!file->open(path, spec) || !file->write_image(OIIO::TypeDesc::UINT8, picture.rgb.data()) ||
      !file->close()) {
    throw OutputError(path, "cannot be written: " + file->geterror());
  }
}

}  // namespace sherd::synthetic
