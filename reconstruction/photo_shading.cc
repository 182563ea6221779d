// Deferred shading of a finished frame from the photographs.
#include <algorithm>
#include <cmath>
#include <list>
#include <memory>

#include "metaball/appearance/light_view.h"
#include "metaball/error.h"
#include "metaball/local_view.h"
#include "metaball/stopwatch.h"
#include "reconstruction/back_faces.h"
#include "reconstruction/parallel.h"
#include "reconstruction/photo_exposure.h"
#include "reconstruction/photo_selection.h"
#include "reconstruction/photo_set.h"
#include "reconstruction/photographs.h"
#include "reconstruction/surface_depths.h"
#include "reconstruction/surface_point.h"

namespace sherd {
namespace {

// Pixels are worked on in squares of this side: they look at few photographs, and at much the same
// as the squares beside them.
constexpr int kSquare = 512;
constexpr std::size_t kBlock = 1024;
// The photographs a picture may use: the nearest by direction at points of a grid over it.
constexpr int kGridPixels = 24;
constexpr std::size_t kNearestAtPoint = 12;
constexpr std::size_t kMostLevels = 4;  // whose depth maps are kept
// Places at which exposures are compared, and photographs that look at each.
constexpr std::size_t kExposurePlaces = 8000;
constexpr std::size_t kExposurePhotos = 8;
// What is finer than a lookup's surroundings is taken from the best photograph almost alone, what
// is coarser is blended from all (Burt and Adelson's idea with two bands, over weights instead of
// masks).
constexpr float kSharpness = 3;  // exponent of the fine band's weights
// A photograph whose surroundings differ from the others' median by this much (natural logarithm)
// has half its weight.
constexpr float kDisagreement = 0.35f;

struct Square {
  std::vector<std::uint32_t> pixel;  // of each hit
  std::vector<std::uint32_t> begin;  // lookups of hit i: begin[i] .. begin[i + 1]
  std::vector<PhotoLookup> lookups;
  std::vector<PhotoColors> colors;  // of each lookup, exposures evened out
  std::vector<char> there;          // false for one whose photograph cannot be read
};

Vec3f Times(const Vec3f& a, const Vec3f& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

float LumaOf(const Vec3f& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

// The colour that the lookups of hit i make; false without any.
bool Blend(const Square& square, std::size_t i, Vec3f* color) {
  float weight[kMostPhotos], luma[kMostPhotos];
  std::size_t n = 0, at[kMostPhotos];
  float most = 0;
  for (std::size_t j = square.begin[i]; j < square.begin[i + 1]; ++j) {
    if (!square.there[j]) continue;
    weight[n] = square.lookups[j].weight;
    luma[n] = std::log(0.01f + LumaOf(square.colors[j].surroundings));
    most = std::max(most, weight[n]);
    at[n++] = j;
  }
  if (n == 0) return false;
  // The weighted median, each photograph's say between the square root of its weight and it.
  std::size_t order[kMostPhotos];
  for (std::size_t k = 0; k < n; ++k) order[k] = k;
  std::sort(order, order + n, [&](std::size_t a, std::size_t b) { return luma[a] < luma[b]; });
  float total = 0, passed = 0, median = luma[order[0]];
  for (std::size_t k = 0; k < n; ++k) total += std::sqrt(weight[k] / most);
  for (std::size_t k = 0; k < n; ++k) {
    const float w = std::sqrt(weight[order[k]] / most);
    passed += w;
    if (passed >= total / 2) {
      median = luma[order[k]];
      break;
    }
  }
  if (n > 2) {
    for (std::size_t k = 0; k < n; ++k) {
      const float off = (luma[k] - median) / kDisagreement;
      weight[k] /= 1 + off * off;
    }
  }
  Vec3f coarse{}, fine{};
  float coarse_weight = 0, fine_weight = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const PhotoColors& c = square.colors[at[k]];
    const float sharp = std::pow(weight[k] / most, kSharpness);
    coarse += c.surroundings * weight[k];
    coarse_weight += weight[k];
    fine += (c.footprint - c.surroundings) * sharp;
    fine_weight += sharp;
  }
  const Vec3f c = coarse * (1 / coarse_weight) + fine * (1 / std::max(fine_weight, 1e-30f));
  *color = {std::max(c.x, 0.0f), std::max(c.y, 0.0f), std::max(c.z, 0.0f)};
  return true;
}

// What belongs to one cloud and surface: kept from picture to picture.
struct KnownLevel {
  std::uint64_t key = 0;
  std::unique_ptr<SurfaceDepths> depths;
  std::unique_ptr<SurfaceSampler> sampler;
};

}  // namespace

struct PhotographShader::Impl {
  Impl(const Survey& survey, const PhotoShadingOptions& o)
      : options(o),
        bytes(static_cast<std::size_t>(std::max(1, o.memory_mb)) << 20),
        photos(survey, bytes - bytes / 4, o.leave_out),
        cpu(MakeCpuPhotoSampler()) {}

  const PhotoShadingOptions options;
  const std::size_t bytes;
  PhotoSet photos;                            // three quarters of the memory
  std::list<KnownLevel> known;                // one quarter; the one used last first
  std::vector<Vec3f> gain;                    // by photograph; empty until they are known
  std::unique_ptr<PhotoSampler> cpu, device;  // the device where there is one
  std::string device_lost;                    // why it was given up

  KnownLevel& Known(const Level& level, const Surface& surface);
  void FindGains(const Level& level, SurfaceDepths* depths, const Control& control);
  std::vector<std::uint32_t> Candidates(const SurfaceDepths& depths, const Camera& camera,
                                        const Frame& frame) const;
  void Select(const PhotoSelector& selector, const SurfaceSampler& sampler, const BackFaces& backs,
              const Level& level, const Camera& camera, const Frame& frame, Square* square,
              const Control& control) const;
  void Sample(Square* square, const Control& control);
};

KnownLevel& PhotographShader::Impl::Known(const Level& level, const Surface& surface) {
  const std::uint64_t key = SurfaceDepths::KeyOf(level, surface);
  const auto found =
      std::find_if(known.begin(), known.end(), [&](const KnownLevel& k) { return k.key == key; });
  if (found != known.end()) {
    known.splice(known.begin(), known, found);
  } else {
    if (known.size() == kMostLevels) known.pop_back();
    known.push_front(
        {key,
         std::make_unique<SurfaceDepths>(photos.survey(), level, surface, bytes / 4 / kMostLevels),
         std::make_unique<SurfaceSampler>(level.cloud)});
  }
  return known.front();
}

// Exposures are compared at metaballs spread evenly over the cloud (it is in Morton order), in the
// photographs that the level lists there, or, where it has no lists, that see the place.
void PhotographShader::Impl::FindGains(const Level& level, SurfaceDepths* depths,
                                       const Control& control) {
  const std::size_t n = level.cloud.size();
  const bool lists = level.photo_begin.size() == n + 1;
  const bool normals = level.normal.size() == n;
  std::vector<bool> all(photos.size(), true);
  if (!lists) depths->Prepare(level, all, control);
  const std::size_t step = std::max<std::size_t>(1, n / kExposurePlaces);
  std::vector<PhotoLookup> lookups;
  std::vector<ExposureSample> samples;
  std::uint32_t place = 0;
  for (std::size_t i = 0; i < n; i += step) {
    const Vec3d center = level.cloud.frame.WorldFromLocal(level.cloud.center[i]);
    const double spacing = level.stats.spacing > 0
                               ? level.stats.spacing
                               : level.cloud.RadiusOf(i) * level.cloud.frame.unit / 2;
    std::size_t count = 0;
    const auto add = [&](std::uint32_t photo) {
      const PhotoView* const view = photos.View(photo);
      if (!view || count == kExposurePhotos) return;
      const Vec3d way = view->center() - center;
      const double distance = Length(way);
      if (normals && !(Dot(way, level.normal[i].cast<double>()) > 0.3 * distance)) return;
      // The mean over a square as wide as a few metaballs, as it faces the photograph.
      const Vec3d across = Perpendicular(way) * (4 * spacing);
      const Vec3d along = Normalized(Cross(way, across)) * (4 * spacing);
      double x, y, ax, ay, bx, by;
      if (!view->Project(center, &x, &y) || !view->Project(center + across, &ax, &ay) ||
          !view->Project(center + along, &bx, &by)) {
        return;
      }
      PhotoLookup lookup;
      lookup.target = place;
      lookup.photo = photo;
      lookup.x = static_cast<float>(x);
      lookup.y = static_cast<float>(y);
      SetFootprint(ax - x, ay - y, bx - x, by - y, &lookup);
      if (!(photos.Unmasked(lookup, center) > 0)) return;
      lookups.push_back(lookup);
      ++count;
    };
    if (lists) {
      for (std::uint32_t j = level.photo_begin[i]; j < level.photo_begin[i + 1]; ++j) {
        add(level.photo_idx[j]);
      }
    } else {
      for (std::uint32_t photo = 0; photo < photos.size(); ++photo) {
        const Vec3f normal = normals ? level.normal[i] : Vec3f{};
        if (depths->At(photo, center, normal, 3 * spacing).visible > 0.99f) add(photo);
      }
    }
    ++place;
  }
  samples.resize(lookups.size());
  std::vector<char> there(lookups.size(), 0);
  photos.Visit(
      lookups, "comparing exposures",
      [&](std::size_t i, const PhotoPyramid& pyramid) {
        samples[i] = {lookups[i].target, lookups[i].photo, SampleFootprint(pyramid, lookups[i])};
        there[i] = 1;
      },
      control);
  std::vector<ExposureSample> kept;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (there[i]) kept.push_back(samples[i]);
  }
  gain = EvenExposures(kept, place, photos.size());
}

std::vector<std::uint32_t> PhotographShader::Impl::Candidates(const SurfaceDepths& depths,
                                                              const Camera& camera,
                                                              const Frame& frame) const {
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < photos.size(); ++i) {
    if (photos.View(i)) all.push_back(i);
  }
  if (all.size() <= kNearestAtPoint) return all;
  const PhotoSelector selector(photos, depths, all);
  const int columns = (frame.width + kGridPixels - 1) / kGridPixels;
  const int rows = (frame.height + kGridPixels - 1) / kGridPixels;
  std::vector<std::vector<std::uint32_t>> nearest(static_cast<std::size_t>(rows));
  ParallelBlocks(static_cast<std::size_t>(rows), 1, [&](std::size_t row, std::size_t) {
    for (int column = 0; column < columns; ++column) {
      // The first hit of the cell.
      bool found = false;
      for (int y = static_cast<int>(row) * kGridPixels;
           y < std::min<int>(frame.height, static_cast<int>(row + 1) * kGridPixels) && !found;
           ++y) {
        for (int x = column * kGridPixels;
             x < std::min(frame.width, (column + 1) * kGridPixels) && !found; ++x) {
          const std::size_t pixel = static_cast<std::size_t>(y) * frame.width + x;
          if (frame.id[pixel] < 0) continue;
          found = true;
          const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
          selector.Nearest(ray.origin + ray.direction * double(frame.depth[pixel]),
                           frame.normal[pixel], -ray.direction, kNearestAtPoint, &nearest[row]);
        }
      }
    }
  });
  std::vector<bool> needed(photos.size(), false);
  for (const auto& row : nearest) {
    for (const std::uint32_t photo : row) needed[photo] = true;
  }
  std::erase_if(all, [&](std::uint32_t photo) { return !needed[photo]; });
  return all;
}

void PhotographShader::Impl::Select(const PhotoSelector& selector, const SurfaceSampler& sampler,
                                    const BackFaces& backs, const Level& level,
                                    const Camera& camera, const Frame& frame, Square* square,
                                    const Control& control) const {
  const std::size_t blocks = (square->pixel.size() + kBlock - 1) / kBlock;
  std::vector<std::vector<PhotoLookup>> found(blocks);
  ParallelBlocks(
      square->pixel.size(), kBlock,
      [&](std::size_t begin, std::size_t end) {
        ViewedPoint point;
        for (std::size_t i = begin; i < end; ++i) {
          const std::uint32_t pixel = square->pixel[i];
          const double px = pixel % static_cast<std::uint32_t>(frame.width) + 0.5;
          const double py = pixel / static_cast<std::uint32_t>(frame.width) + 0.5;
          const RayD ray = RayThrough(camera, px, py);
          point.to_viewer = -ray.direction;
          if (const BackFaces::Pixel* const back = backs.Find(pixel)) {
            point.hit = ray.origin + ray.direction * double(back->depth);
            point.surface = {point.hit, back->normal, {}};
          } else {
            point.hit = ray.origin + ray.direction * double(frame.depth[pixel]);
            sampler.Sample(level, point.hit, ray.direction, frame.id[pixel], frame.normal[pixel],
                           &point.surface);
          }
          // Half a metaball: the depth maps were sampled elsewhere on the same bumps.
          point.tolerance = 0.5 * level.cloud.RadiusOf(static_cast<std::size_t>(frame.id[pixel])) *
                            level.cloud.frame.unit;
          // Where the rays of the neighbouring pixels meet the tangent plane.
          const Vec3d normal = point.surface.normal.cast<double>();
          const Vec3d& position = point.surface.position;
          const double slope = Dot(ray.direction, normal);
          if (std::abs(slope) > 0.05) {
            const auto on_plane = [&](const RayD& r) {
              const double other = Dot(r.direction, normal);
              const double safe = std::abs(other) > 0.05 ? other : other < 0 ? -0.05 : 0.05;
              return r.origin + r.direction * (Dot(position - r.origin, normal) / safe);
            };
            point.side_x = on_plane(RayThrough(camera, px + 1, py)) - position;
            point.side_y = on_plane(RayThrough(camera, px, py + 1)) - position;
          } else {  // nearly along the surface: the pixel as it faces the viewer
            const double size =
                camera.PixelSizeAt(std::max(1e-12, Dot(position - camera.eye, camera.forward)));
            point.side_x = camera.right * size;
            point.side_y = camera.down * size;
          }
          selector.Select(point, static_cast<std::uint32_t>(i), &found[begin / kBlock]);
        }
      },
      control);
  std::size_t total = 0;
  for (const auto& part : found) total += part.size();
  square->lookups.reserve(total);
  square->begin.assign(square->pixel.size() + 1, 0);
  for (auto& part : found) {
    for (const PhotoLookup& lookup : part) ++square->begin[lookup.target + 1];
    square->lookups.insert(square->lookups.end(), part.begin(), part.end());
    part = {};
  }
  for (std::size_t i = 0; i < square->pixel.size(); ++i) square->begin[i + 1] += square->begin[i];
}

void PhotographShader::Impl::Sample(Square* square, const Control& control) {
  const auto sample_on = [&](PhotoSampler* sampler) {
    photos.Sample(square->lookups, "projecting the photographs", sampler, &square->colors,
                  &square->there, control);
  };
  const auto give_up = [&](const Error& error) {
    device_lost = error.what();
    device.reset();
  };
  if (device) {
    try {
      sample_on(device.get());
    } catch (const DeviceError& error) {
      give_up(error);
    } catch (const ResourceError& error) {
      give_up(error);
    }
  }
  if (!device) sample_on(cpu.get());
  if (gain.empty()) return;
  for (std::size_t i = 0; i < square->lookups.size(); ++i) {
    const Vec3f& g = gain[square->lookups[i].photo];
    square->colors[i] = {Times(square->colors[i].footprint, g),
                         Times(square->colors[i].surroundings, g)};
  }
}

PhotographShader::PhotographShader(const Survey& survey, const PhotoShadingOptions& options)
    : impl_(std::make_unique<Impl>(survey, options)) {}
PhotographShader::~PhotographShader() = default;
PhotographShader::PhotographShader(PhotographShader&&) noexcept = default;

void PhotographShader::SampleOn(std::unique_ptr<PhotoSampler> sampler) {
  impl_->device = std::move(sampler);
  impl_->device_lost.clear();
}

PhotoShadingStats PhotographShader::Shade(const Level& level, const Surface& surface,
                                          const Camera& camera, Frame* frame,
                                          const Control& control) {
  const Stopwatch watch;
  const std::size_t pixels = frame->color.size();
  if (frame->depth.size() != pixels || frame->normal.size() != pixels ||
      frame->id.size() != pixels || frame->width != camera.width ||
      frame->height != camera.height) {
    throw Error("colours from photographs need a frame with depth, normal and id of this camera");
  }
  PhotoShadingStats stats;
  PhotoSet& photos = impl_->photos;
  photos.ClearUsed();
  photos.Prepare(std::vector<bool>(photos.size(), true), control);
  const KnownLevel& known = impl_->Known(level, surface);
  SurfaceDepths& depths = *known.depths;
  if (impl_->gain.empty() && impl_->options.even_exposures) {
    impl_->FindGains(level, &depths, control);
    photos.ClearUsed();
  }
  const std::vector<std::uint32_t> candidates = impl_->Candidates(depths, camera, *frame);
  std::vector<bool> needed(photos.size(), false);
  for (const std::uint32_t photo : candidates) needed[photo] = true;
  depths.Prepare(level, needed, control);
  const PhotoSelector selector(photos, depths, candidates);
  const SurfaceSampler& sampler = *known.sampler;
  const BackFaces backs(level, sampler, camera, *frame);
  const int columns = (frame->width + kSquare - 1) / kSquare;
  const int rows = (frame->height + kSquare - 1) / kSquare;
  for (int k = 0; k < columns * rows; ++k) {
    control.ThrowIfStopped();
    Square square;
    // To the right and to the left in turn: the next square is beside the last one.
    const int row = k / columns, column = row % 2 ? columns - 1 - k % columns : k % columns;
    for (int y = row * kSquare; y < std::min((row + 1) * kSquare, frame->height); ++y) {
      for (int x = column * kSquare; x < std::min((column + 1) * kSquare, frame->width); ++x) {
        const std::size_t pixel = static_cast<std::size_t>(y) * frame->width + x;
        const std::int32_t id = frame->id[pixel];
        if (id < 0 || static_cast<std::size_t>(id) >= level.cloud.size()) continue;
        if (frame->color[pixel].a > 0) square.pixel.push_back(static_cast<std::uint32_t>(pixel));
      }
    }
    if (square.pixel.empty()) continue;
    impl_->Select(selector, sampler, backs, level, camera, *frame, &square, control);
    impl_->Sample(&square, control);
    for (std::size_t i = 0; i < square.pixel.size(); ++i) {
      ++stats.pixels;
      const std::uint32_t pixel = square.pixel[i];
      const bool hole = backs.Find(pixel) != nullptr;
      Vec3f color;
      if (!(hole && impl_->options.show_unseen) && Blend(square, i, &color)) {
        ++stats.from_photos;
        stats.across_holes += hole;
      } else {
        ++stats.without_photo;
        if (!impl_->options.show_unseen) continue;
        color = LinearFromRgb8(kUnseenColor);
      }
      if (!frame->light.empty()) color = ColorInLight(color, frame->light[pixel]);
      Pixel& out = frame->color[pixel];
      out.r = color.x * out.a;
      out.g = color.y * out.a;
      out.b = color.z * out.a;
    }
  }
  stats.photos_used = photos.used();
  stats.photos_unreadable = photos.unreadable();
  stats.warnings = photos.Warnings();
  if (!impl_->device_lost.empty()) {
    stats.warnings.push_back("the photographs are looked up on the CPU: " + impl_->device_lost);
  }
  stats.seconds = watch.Seconds();
  return stats;
}

}  // namespace sherd
