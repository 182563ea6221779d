// Deferred shading of a finished frame from the photographs.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>

#include "metaball/error.h"
#include "metaball/local_view.h"
#include "reconstruction/parallel.h"
#include "reconstruction/photo_store.h"
#include "reconstruction/photo_view.h"
#include "reconstruction/photographs.h"
#include "reconstruction/surface_point.h"

namespace sherd {
namespace {

constexpr std::size_t kBandHits = 1 << 19;  // surface pixels worked on at once
constexpr std::size_t kBlock = 2048;
constexpr std::size_t kMostPhotos = 4;  // blended at one place
constexpr int kMostSamples = 8;         // along the longer axis of a footprint

// One photograph's part in one pixel.
struct Lookup {
  std::uint32_t hit = 0;  // within the band
  std::uint16_t photo = 0;
  std::uint16_t samples = 1;
  float weight = 0;
  float x = 0, y = 0;            // pixels of the file
  float axis_x = 0, axis_y = 0;  // the footprint's longer axis, whole
  float level = 0;
};

struct Band {
  std::vector<std::uint32_t> pixel;  // of each hit
  std::vector<Lookup> lookups;
};

// The footprint of a pixel: the images a and b of its two sides in the photograph.
void SetFootprint(double ax, double ay, double bx, double by, Lookup* lookup) {
  // Singular values of [a b]: the axes of the ellipse.
  const double e = (ax * ax + ay * ay + bx * bx + by * by) / 2;
  const double det = ax * by - ay * bx;
  const double root = std::sqrt(std::max(0.0, e * e - det * det));
  const double longer = std::sqrt(e + root);
  const double shorter = longer > 0 ? std::abs(det) / longer : 0;
  // The longer axis in the photograph: the eigenvector of a a^T + b b^T.
  const double xx = ax * ax + bx * bx, xy = ax * ay + bx * by, yy = ay * ay + by * by;
  double ux = xx - yy + 2 * root, uy = 2 * xy;
  if (std::abs(ux) + std::abs(uy) < 1e-12 * (xx + yy)) {
    ux = xx >= yy ? 1 : 0;
    uy = xx >= yy ? 0 : 1;
  }
  const double length = std::hypot(ux, uy);
  const double samples =
      std::clamp(std::ceil(longer / std::max(shorter, 1.0)), 1.0, double(kMostSamples));
  lookup->samples = static_cast<std::uint16_t>(samples);
  lookup->axis_x = static_cast<float>(length > 0 ? ux / length * longer : 0);
  lookup->axis_y = static_cast<float>(length > 0 ? uy / length * longer : 0);
  lookup->level = static_cast<float>(std::log2(std::max(1.0, longer / samples)));
}

// 1 inside, falling to 0 over the outer twentieth of the picture.
double BorderWeight(double x, double y, double width, double height) {
  const double margin = 0.05 * std::min(width, height);
  const double distance = std::min({x, y, width - x, height - y});
  const double t = std::clamp(distance / margin, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

struct PhotographShader::Impl {
  Impl(const Survey& s, int memory_mb)
      : survey(s),
        store(static_cast<std::size_t>(std::max(1, memory_mb)) << 20),
        views(s.photographs.size()),
        tried(s.photographs.size(), false) {}

  const Survey& survey;
  PhotoStore store;
  std::vector<std::optional<PhotoView>> views;  // made when first needed
  std::vector<bool> tried;
  std::vector<std::string> problems;

  void PrepareViews(const Level& level);
  void CollectLookups(const SurfaceSampler& sampler, const Camera& camera, const Frame& frame,
                      Band* band, const Control& control) const;
  void SamplePhotos(const Band& band, std::vector<Vec3f>* color, std::vector<float>* weight,
                    std::vector<bool>* used, const Control& control);
};

void PhotographShader::Impl::PrepareViews(const Level& level) {
  std::vector<bool> needed(views.size(), false);
  for (const std::uint16_t photo : level.photo_idx) {
    if (photo < needed.size()) needed[photo] = true;
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!needed[i] || tried[i]) continue;
    tried[i] = true;
    try {
      views[i].emplace(survey, i);
    } catch (const InputError& error) {
      problems.push_back(error.what());
    }
  }
}

void PhotographShader::Impl::CollectLookups(const SurfaceSampler& sampler, const Camera& camera,
                                            const Frame& frame, Band* band,
                                            const Control& control) const {
  const std::size_t blocks = (band->pixel.size() + kBlock - 1) / kBlock;
  std::vector<std::vector<Lookup>> found(blocks);
  ParallelBlocks(
      band->pixel.size(), kBlock,
      [&](std::size_t begin, std::size_t end) {
        std::vector<Lookup>& out = found[begin / kBlock];
        SurfacePoint point;
        std::vector<Lookup> candidates;
        for (std::size_t i = begin; i < end; ++i) {
          const std::uint32_t pixel = band->pixel[i];
          const double px = pixel % static_cast<std::uint32_t>(frame.width) + 0.5;
          const double py = pixel / static_cast<std::uint32_t>(frame.width) + 0.5;
          const RayD ray = RayThrough(camera, px, py);
          const Vec3d hit = ray.origin + ray.direction * double(frame.depth[pixel]);
          sampler.Sample(hit, ray.direction, frame.id[pixel], frame.normal[pixel], &point);
          if (point.photos.empty()) continue;
          // Where the rays of the neighbouring pixels meet the tangent plane.
          const Vec3d normal = point.normal.cast<double>();
          const auto on_plane = [&](const RayD& r) {
            const double slope = Dot(r.direction, normal);
            const double safe = std::abs(slope) > 0.05 ? slope : slope < 0 ? -0.05 : 0.05;
            return r.origin + r.direction * (Dot(point.position - r.origin, normal) / safe);
          };
          const double slope = Dot(ray.direction, normal);
          Vec3d side_x, side_y;
          if (std::abs(slope) > 0.05) {
            side_x = on_plane(RayThrough(camera, px + 1, py)) - point.position;
            side_y = on_plane(RayThrough(camera, px, py + 1)) - point.position;
          } else {  // nearly along the surface: the pixel as it faces the viewer
            const double size = camera.PixelSizeAt(
                std::max(1e-12, Dot(point.position - camera.eye, camera.forward)));
            side_x = camera.right * size;
            side_y = camera.down * size;
          }
          candidates.clear();
          for (const SurfacePoint::PhotoShare& share : point.photos) {
            if (share.photo >= views.size() || !views[share.photo]) continue;
            const PhotoView& view = *views[share.photo];
            const Vec3d to_photo = view.center() - point.position;
            const double cosine = Dot(Normalized(to_photo), normal);
            if (!(cosine > 0.05)) continue;
            double x, y, ax, ay, bx, by;
            if (!view.Project(point.position, &x, &y) ||
                !view.Project(point.position + side_x, &ax, &ay) ||
                !view.Project(point.position + side_y, &bx, &by)) {
              continue;
            }
            Lookup lookup;
            lookup.hit = static_cast<std::uint32_t>(i);
            lookup.photo = share.photo;
            lookup.x = static_cast<float>(x);
            lookup.y = static_cast<float>(y);
            SetFootprint(ax - x, ay - y, bx - x, by - y, &lookup);
            // Detail counts as far as the picture can show it: photograph pixels per picture pixel,
            // up to one.
            const double area = std::abs((ax - x) * (by - y) - (ay - y) * (bx - x));
            const double detail = std::min(1.0, area);
            lookup.weight = static_cast<float>(share.weight * cosine * cosine * detail *
                                               BorderWeight(x, y, view.width(), view.height()));
            if (lookup.weight > 0) candidates.push_back(lookup);
          }
          if (candidates.size() > kMostPhotos) {
            std::partial_sort(candidates.begin(), candidates.begin() + kMostPhotos + 1,
                              candidates.end(), [](const Lookup& a, const Lookup& b) {
                                return a.weight != b.weight ? a.weight > b.weight
                                                            : a.photo < b.photo;
                              });
            // The weight of the first one left out is taken off: what enters or leaves the list
            // from pixel to pixel does so at weight 0, without a seam.
            const float floor = candidates[kMostPhotos].weight;
            candidates.resize(kMostPhotos);
            if (candidates.front().weight > floor) {
              for (Lookup& lookup : candidates) lookup.weight -= floor;
            }
          }
          out.insert(out.end(), candidates.begin(), candidates.end());
        }
      },
      control);
  for (const auto& part : found) {
    band->lookups.insert(band->lookups.end(), part.begin(), part.end());
  }
}

void PhotographShader::Impl::SamplePhotos(const Band& band, std::vector<Vec3f>* color,
                                          std::vector<float>* weight, std::vector<bool>* used,
                                          const Control& control) {
  // Lookups by photograph: each photograph is decoded once a band.
  std::vector<std::uint32_t> begin(views.size() + 1, 0);
  for (const Lookup& lookup : band.lookups) ++begin[std::size_t{lookup.photo} + 1];
  for (std::size_t i = 0; i < views.size(); ++i) begin[i + 1] += begin[i];
  std::vector<std::uint32_t> order(band.lookups.size());
  {
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (std::size_t i = 0; i < band.lookups.size(); ++i) {
      order[next[band.lookups[i].photo]++] = static_cast<std::uint32_t>(i);
    }
  }
  std::vector<PhotoStore::Request> requests;
  std::vector<std::size_t> photo_of;
  for (std::size_t photo = 0; photo < views.size(); ++photo) {
    if (begin[photo] == begin[photo + 1]) continue;
    float finest = 30;
    for (std::uint32_t i = begin[photo]; i < begin[photo + 1]; ++i) {
      finest = std::min(finest, band.lookups[order[i]].level);
    }
    const PhotoView& view = *views[photo];
    requests.push_back({view.path(), view.width(), view.height(), static_cast<int>(finest)});
    photo_of.push_back(photo);
  }
  for (std::size_t r = 0; r < requests.size();) {
    control.Report("projecting the photographs",
                   static_cast<double>(r) / static_cast<double>(requests.size()));
    const auto pyramids = store.Fetch(requests, r, control, &problems);
    for (const auto& pyramid : pyramids) {
      const std::size_t photo = photo_of[r++];
      if (!pyramid) {
        views[photo].reset();
        continue;
      }
      (*used)[photo] = true;
      const std::uint32_t first = begin[photo];
      // A pixel looks up each photograph once: no two of these write to the same place.
      ParallelBlocks(
          begin[photo + 1] - first, kBlock,
          [&](std::size_t from, std::size_t to) {
            for (std::size_t i = from; i < to; ++i) {
              const Lookup& lookup = band.lookups[order[first + i]];
              Vec3f sum{};
              for (int s = 0; s < lookup.samples; ++s) {
                const float t =
                    (static_cast<float>(s) + 0.5f) / static_cast<float>(lookup.samples) - 0.5f;
                sum += pyramid->Sample(lookup.x + t * lookup.axis_x, lookup.y + t * lookup.axis_y,
                                       lookup.level);
              }
              (*color)[lookup.hit] += sum * (lookup.weight / static_cast<float>(lookup.samples));
              (*weight)[lookup.hit] += lookup.weight;
            }
          },
          control);
    }
  }
}

PhotographShader::PhotographShader(const Survey& survey, int memory_mb)
    : impl_(std::make_unique<Impl>(survey, memory_mb)) {}
PhotographShader::~PhotographShader() = default;
PhotographShader::PhotographShader(PhotographShader&&) noexcept = default;

PhotoShadingStats PhotographShader::Shade(const Level& level, const Camera& camera,
                                          const Lighting& lighting, Frame* frame,
                                          const Control& control) {
  const auto start = std::chrono::steady_clock::now();
  const std::size_t pixels = frame->color.size();
  if (frame->depth.size() != pixels || frame->normal.size() != pixels ||
      frame->id.size() != pixels || frame->width != camera.width ||
      frame->height != camera.height) {
    throw Error("colours from photographs need a frame with depth, normal and id of this camera");
  }
  PhotoShadingStats stats;
  impl_->problems.clear();
  if (level.photo_begin.size() == level.cloud.size() + 1) {
    impl_->PrepareViews(level);
    const SurfaceSampler sampler(level);
    const FrameLight light = PrepareLight(lighting);
    std::vector<bool> used(impl_->views.size(), false);
    for (std::size_t next = 0; next < pixels;) {
      control.ThrowIfStopped();
      Band band;
      for (; next < pixels && band.pixel.size() < kBandHits; ++next) {
        const std::int32_t id = frame->id[next];
        if (id < 0 || static_cast<std::size_t>(id) >= level.cloud.size()) continue;
        if (frame->color[next].a > 0) band.pixel.push_back(static_cast<std::uint32_t>(next));
      }
      if (band.pixel.empty()) continue;
      impl_->CollectLookups(sampler, camera, *frame, &band, control);
      std::vector<Vec3f> color(band.pixel.size());
      std::vector<float> weight(band.pixel.size(), 0.0f);
      impl_->SamplePhotos(band, &color, &weight, &used, control);
      for (std::size_t i = 0; i < band.pixel.size(); ++i) {
        ++stats.pixels;
        if (!(weight[i] > 0)) {
          ++stats.without_photo;
          continue;
        }
        ++stats.from_photos;
        const std::uint32_t pixel = band.pixel[i];
        const RayD ray = RayThrough(camera, pixel % static_cast<std::uint32_t>(frame->width) + 0.5,
                                    pixel / static_cast<std::uint32_t>(frame->width) + 0.5);
        const Vec3f lit = sherd::Shade(light, color[i] * (1 / weight[i]), frame->normal[pixel],
                                       (-ray.direction).cast<float>());
        Pixel& out = frame->color[pixel];
        out.r = lit.x * out.a;
        out.g = lit.y * out.a;
        out.b = lit.z * out.a;
      }
    }
    stats.photos_used = static_cast<std::uint64_t>(std::count(used.begin(), used.end(), true));
  } else {
    // Which photographs see a place is not known: every surface pixel keeps its colour.
    stats.pixels = stats.without_photo = static_cast<std::uint64_t>(
        std::count_if(frame->id.begin(), frame->id.end(), [](std::int32_t id) { return id >= 0; }));
    if (stats.pixels > 0) {
      stats.warnings.push_back(
          "which photographs see the surface is not known: the points' own colours are shown");
    }
  }
  for (std::size_t i = 0; i < impl_->views.size(); ++i) {
    stats.photos_unreadable += impl_->tried[i] && !impl_->views[i];
  }
  if (!impl_->problems.empty()) {
    const std::size_t n = impl_->problems.size();
    stats.warnings.push_back(std::to_string(n) + (n == 1 ? " photograph" : " photographs") +
                             " could not be used: " + impl_->problems.front() +
                             (n > 1 ? " (and others)" : ""));
  }
  stats.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return stats;
}

}  // namespace sherd
