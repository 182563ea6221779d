// Deferred shading of a finished frame from the photographs.
#include <algorithm>
#include <cmath>
#include <functional>
#include <list>
#include <memory>
#include <utility>

#include "metaball/appearance/light_view.h"
#include "metaball/error.h"
#include "metaball/local_view.h"
#include "metaball/photo/photo_blend.h"
#include "metaball/photo/photo_choice.h"
#include "metaball/photo/photo_shader.h"
#include "metaball/photo/viewed_point.h"
#include "metaball/stopwatch.h"
#include "reconstruction/back_faces.h"
#include "reconstruction/level_digest.h"
#include "reconstruction/level_sheet.h"
#include "reconstruction/parallel.h"
#include "reconstruction/photo_candidates.h"
#include "reconstruction/photo_exposure.h"
#include "reconstruction/photo_set.h"
#include "reconstruction/photographs.h"
#include "reconstruction/surface_depths.h"

namespace sherd {
namespace {

// Pixels are worked on in squares of this side: they look at few photographs, and at much the same
// as the squares beside them.
constexpr int kSquare = 512;
constexpr std::size_t kBlock = 1024;
constexpr std::size_t kMostLevels = 4;  // whose depth maps are kept
// Places at which exposures are compared, and photographs that look at each.
constexpr std::size_t kExposurePlaces = 8000;
constexpr std::size_t kExposurePhotos = 8;
struct Square {
  std::vector<std::uint32_t> pixel;  // of each hit
  std::vector<std::uint32_t> begin;  // lookups of hit i: begin[i] .. begin[i + 1]
  std::vector<PhotoLookup> lookups;
  std::vector<PhotoColors> colors;  // of each lookup, exposures evened out
  std::vector<char> there;          // false for one whose photograph cannot be read
};

// The colour that the lookups of hit i make; false without any.
bool Blend(const Square& square, std::size_t i, Vec3f* color) {
  float weight[kMostPhotos];
  PhotoColors colors[kMostPhotos];
  int n = 0;
  for (std::size_t j = square.begin[i]; j < square.begin[i + 1]; ++j) {
    if (!square.there[j]) continue;
    weight[n] = square.lookups[j].weight;
    colors[n++] = square.colors[j];
  }
  if (n > 0) *color = BlendPhotos(weight, colors, n);
  return n > 0;
}

// SheetView::ShareOf of all photographs at once: quicker than a walk for each.
class PhotoShares {
 public:
  PhotoShares(const SheetView& sheet, std::size_t photos) : sheet_(sheet), seen_(photos, 0.0f) {}

  void Clear() {
    for (const std::uint16_t photo : listed_) seen_[photo] = 0;
    listed_.clear();
    total_ = 0;
  }
  void Add(std::uint32_t i, float weight) {
    if (!sheet_.photo_begin || !(weight > 0)) return;
    total_ += weight;
    for (std::uint32_t j = sheet_.photo_begin[i]; j < sheet_.photo_begin[i + 1]; ++j) {
      const std::uint16_t photo = sheet_.photo_idx[j];
      if (photo >= seen_.size()) continue;  // of another survey
      if (seen_[photo] == 0) listed_.push_back(photo);
      seen_[photo] += weight;
    }
  }
  float Of(std::uint32_t photo) const { return seen_[photo] > 0 ? seen_[photo] / total_ : 0; }

 private:
  const SheetView& sheet_;
  std::vector<float> seen_;            // by photograph: weights of metaballs that list it
  std::vector<std::uint16_t> listed_;  // photographs that are not 0 there
  float total_ = 0;
};

// What belongs to one level and surface: kept from picture to picture.
struct KnownLevel {
  std::uint64_t id = 0;        // of no other
  std::uint64_t sheet_id = 0;  // of other surfaces of the same level as well
  std::uint64_t digest = 0;    // of the level
  std::weak_ptr<const Level> level;
  Surface surface;
  std::unique_ptr<SurfaceDepths> depths;
  std::shared_ptr<const SupportIndex> index;  // of the sheet, which other surfaces share
};

}  // namespace

struct PhotographShader::Impl {
  Impl(const Survey& survey, const PhotoShadingOptions& o)
      : options(o),
        bytes(static_cast<std::size_t>(std::max(1, o.memory_mb)) << 20),
        photos(survey, bytes - bytes / 4, o.leave_out) {}

  const PhotoShadingOptions options;
  const std::size_t bytes;
  PhotoSet photos;              // three quarters of the memory
  std::list<KnownLevel> known;  // one quarter; the one used last first
  std::uint64_t levels_known = 0;
  std::vector<Vec3f> gain;              // by photograph; empty until they are known
  std::unique_ptr<PhotoShader> device;  // where there is one
  std::string device_lost;              // why it was given up, or could not make this picture
  std::unique_ptr<Renderer> cpu = MakeCpuRenderer();
  Renderer* renderer = cpu.get();

  KnownLevel& Known(const std::shared_ptr<const Level>& level, const Surface& surface);
  void FindGains(const std::shared_ptr<const Level>& level, SurfaceDepths* depths,
                 const Control& control);
  PhotoCounts ShadeOnCpu(const PhotoScene& scene, const Camera& camera, Frame* frame,
                         const Control& control);
  void Select(const PhotoScene& scene, const BackFaces& backs, const Camera& camera,
              const Frame& frame, Square* square, const Control& control) const;
  void Sample(Square* square, const Control& control);
};

KnownLevel& PhotographShader::Impl::Known(const std::shared_ptr<const Level>& level,
                                          const Surface& surface) {
  const auto to_front = [&](std::list<KnownLevel>::iterator it) {
    known.splice(known.begin(), known, it);
    known.front().level = level;
    return std::ref(known.front());
  };
  const auto is_level = [&](const KnownLevel& k) { return k.level.lock() == level; };
  auto found = std::find_if(known.begin(), known.end(), [&](const KnownLevel& k) {
    return is_level(k) && k.surface == surface;
  });
  if (found != known.end()) return to_front(found);
  // A level that was read anew is the one of before.
  auto other = std::find_if(known.begin(), known.end(), is_level);
  const std::uint64_t digest = other != known.end() ? other->digest : DigestOf(*level);
  const auto is_equal = [&](const KnownLevel& k) { return k.digest == digest; };
  found = std::find_if(known.begin(), known.end(),
                       [&](const KnownLevel& k) { return is_equal(k) && k.surface == surface; });
  if (found != known.end()) return to_front(found);
  other = std::find_if(known.begin(), known.end(), is_equal);
  KnownLevel added;
  added.id = ++levels_known;
  added.digest = digest;
  added.level = level;
  added.surface = surface;
  added.depths =
      std::make_unique<SurfaceDepths>(photos.survey(), *level, surface, bytes / 4 / kMostLevels);
  if (other != known.end()) {
    added.index = other->index;
    added.sheet_id = other->sheet_id;
  } else {
    added.index = std::make_shared<const SupportIndex>(IndexOfSheet(level->cloud));
    added.sheet_id = added.id;
  }
  if (known.size() == kMostLevels) known.pop_back();
  known.push_front(std::move(added));
  return known.front();
}

// Exposures are compared at metaballs spread evenly over the cloud (it is in Morton order), in the
// photographs that the level lists there, or, where it has no lists, that see the place.
void PhotographShader::Impl::FindGains(const std::shared_ptr<const Level>& shared,
                                       SurfaceDepths* depths, const Control& control) {
  const Level& level = *shared;
  const std::size_t n = level.cloud.size();
  const bool lists = level.photo_begin.size() == n + 1;
  const bool normals = level.normal.size() == n;
  std::vector<bool> all(photos.size(), true);
  if (!lists) depths->Prepare(shared, all, renderer, control);
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
        const PhotoSight sight = depths->sights()[photo].At(center, normal, 3 * spacing);
        if (sight.visible > 0.99f) add(photo);
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

void PhotographShader::Impl::Select(const PhotoScene& scene, const BackFaces& backs,
                                    const Camera& camera, const Frame& frame, Square* square,
                                    const Control& control) const {
  const std::size_t blocks = (square->pixel.size() + kBlock - 1) / kBlock;
  const PhotosView view = photos.ViewOf(scene.sight, scene.candidates);
  std::vector<std::vector<PhotoLookup>> found(blocks);
  ParallelBlocks(
      square->pixel.size(), kBlock,
      [&](std::size_t begin, std::size_t end) {
        PhotoShares shares(scene.sheet, scene.camera.size());
        PhotoLookup chosen[kMostPhotos];
        for (std::size_t i = begin; i < end; ++i) {
          const std::uint32_t pixel = square->pixel[i];
          PixelHit hit{static_cast<int>(pixel % static_cast<std::uint32_t>(frame.width)),
                       static_cast<int>(pixel / static_cast<std::uint32_t>(frame.width)),
                       frame.depth[pixel], frame.normal[pixel], frame.id[pixel]};
          if (const BackFaces::Pixel* const back = backs.Find(pixel)) {
            hit.depth = back->depth;
            hit.normal = back->normal;
            hit.on_sheet = true;
          }
          shares.Clear();
          const ViewedPoint point = ViewPoint(
              camera, scene.sheet, hit,
              [&](std::uint32_t metaball, float weight) { shares.Add(metaball, weight); });
          const int count = ChoosePhotos(
              view, point, [&](std::uint32_t photo) { return shares.Of(photo); }, chosen);
          for (int k = 0; k < count; ++k) {
            chosen[k].target = static_cast<std::uint32_t>(i);
            found[begin / kBlock].push_back(chosen[k]);
          }
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
  square->colors.assign(square->lookups.size(), {});
  square->there.assign(square->lookups.size(), 0);
  photos.Visit(
      square->lookups, "projecting the photographs",
      [&](std::size_t i, const PhotoPyramid& pyramid) {
        const PhotoLookup& lookup = square->lookups[i];
        const PhotoColors colors = SampleColors(pyramid, lookup);
        square->colors[i] = gain.empty() ? colors : WithGain(colors, gain[lookup.photo]);
        square->there[i] = 1;
      },
      control);
}

PhotoCounts PhotographShader::Impl::ShadeOnCpu(const PhotoScene& scene, const Camera& camera,
                                               Frame* frame, const Control& control) {
  PhotoCounts counts;
  photos.ClearUsed();
  const BackFaces backs(scene.sheet, camera, *frame);
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
        if (id < 0 || static_cast<std::uint32_t>(id) >= scene.sheet.count) continue;
        if (frame->color[pixel].a > 0) square.pixel.push_back(static_cast<std::uint32_t>(pixel));
      }
    }
    if (square.pixel.empty()) continue;
    Select(scene, backs, camera, *frame, &square, control);
    Sample(&square, control);
    for (std::size_t i = 0; i < square.pixel.size(); ++i) {
      ++counts.pixels;
      const std::uint32_t pixel = square.pixel[i];
      const bool hole = backs.Find(pixel) != nullptr;
      Vec3f color;
      if (!(hole && scene.show_unseen) && Blend(square, i, &color)) {
        ++counts.from_photos;
        counts.across_holes += hole;
      } else {
        ++counts.without_photo;
        if (!scene.show_unseen) continue;
        color = LinearFromRgb8(kUnseenColor);
      }
      if (!frame->light.empty()) color = ColorInLight(color, frame->light[pixel]);
      Pixel& out = frame->color[pixel];
      out = {color.x * out.a, color.y * out.a, color.z * out.a, out.a};
    }
  }
  counts.used = photos.used_photos();
  return counts;
}

PhotographShader::PhotographShader(const Survey& survey, const PhotoShadingOptions& options)
    : impl_(std::make_unique<Impl>(survey, options)) {}
PhotographShader::~PhotographShader() = default;
PhotographShader::PhotographShader(PhotographShader&&) noexcept = default;

void PhotographShader::ShadeOn(std::unique_ptr<PhotoShader> device) {
  impl_->device = std::move(device);
  impl_->device_lost.clear();
}

void PhotographShader::DrawWith(Renderer* renderer) {
  impl_->renderer = renderer ? renderer : impl_->cpu.get();
}

PhotoShadingStats PhotographShader::Shade(const Level& level, const Surface& surface,
                                          const Camera& camera, Frame* frame,
                                          const Control& control) {
  return Shade(std::shared_ptr<const Level>(&level, [](const Level*) {}), surface, camera, frame,
               control);
}

PhotoShadingStats PhotographShader::Shade(const std::shared_ptr<const Level>& level,
                                          const Surface& surface, const Camera& camera,
                                          Frame* frame, const Control& control) {
  const Stopwatch watch;
  const std::size_t pixels = frame->color.size();
  if (frame->depth.size() != pixels || frame->normal.size() != pixels ||
      frame->id.size() != pixels || frame->width != camera.width ||
      frame->height != camera.height) {
    throw Error("colours from photographs need a frame with depth, normal and id of this camera");
  }
  PhotoSet& photos = impl_->photos;
  photos.Prepare(std::vector<bool>(photos.size(), true), control);
  const KnownLevel& known = impl_->Known(level, surface);
  SurfaceDepths& depths = *known.depths;
  if (impl_->gain.empty() && impl_->options.even_exposures) {
    impl_->FindGains(level, &depths, control);
  }
  const Stopwatch looking;
  const std::vector<std::uint32_t> candidates = PhotoCandidates(photos, camera, *frame);
  const double seconds_looking = looking.Seconds();
  std::vector<bool> needed(photos.size(), false);
  for (const std::uint32_t photo : candidates) needed[photo] = true;
  depths.Prepare(level, needed, impl_->renderer, control);
  const double seconds_once = watch.Seconds() - seconds_looking;
  const double decoding = photos.seconds_decoding();

  PhotoScene scene;
  scene.sheet = SheetOf(*level, *known.index);
  scene.sheet_key = known.sheet_id;
  scene.sight_key = known.id;
  scene.camera = photos.cameras();
  scene.sight = depths.sights();
  scene.mask = photos.masks();
  scene.gain = impl_->gain;
  scene.candidates = candidates;
  scene.show_unseen = impl_->options.show_unseen;
  PhotoCounts counts;
  bool shaded = false;
  if (impl_->device) {
    impl_->device_lost.clear();
    try {
      impl_->device->Shade(scene, camera, &photos, frame, &counts, control);
      shaded = true;
    } catch (const DeviceError& error) {
      impl_->device_lost = error.what();
      impl_->device.reset();
    } catch (const ResourceError& error) {  // there may be room again for the next one
      impl_->device_lost = error.what();
    }
  }
  if (!shaded) counts = impl_->ShadeOnCpu(scene, camera, frame, control);

  PhotoShadingStats stats;
  stats.pixels = counts.pixels;
  stats.from_photos = counts.from_photos;
  stats.across_holes = counts.across_holes;
  stats.without_photo = counts.without_photo;
  stats.photos_used =
      static_cast<std::uint64_t>(std::count(counts.used.begin(), counts.used.end(), true));
  stats.photos_unreadable = photos.unreadable();
  stats.warnings = photos.Warnings();
  if (!impl_->device_lost.empty()) {
    stats.warnings.push_back("the photographs are looked up on the CPU: " + impl_->device_lost);
  }
  stats.seconds_once = seconds_once + photos.seconds_decoding() - decoding;
  stats.seconds = watch.Seconds();
  return stats;
}

}  // namespace sherd
