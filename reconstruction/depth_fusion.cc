#include "reconstruction/depth_fusion.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <map>
#include <memory>
#include <numbers>
#include <optional>

#include "metaball/error.h"
#include "reconstruction/camera_projector.h"
#include "reconstruction/depth_map.h"
#include "reconstruction/memory.h"
#include "reconstruction/parallel.h"
#include "reconstruction/photographs.h"
#include "reconstruction/point_arrays.h"

namespace sherd {
namespace {

constexpr std::size_t kMostNeighbors = 20;
constexpr int kSampleSide = 12;         // of the grid of pixels that finds the neighbours
constexpr std::size_t kRowsAtOnce = 8;  // of the reference map

// A photograph with a depth map.
struct View {
  std::uint32_t photo_idx = 0;
  std::string depth_path, normal_path;
  MapHeader size;
  const Photograph* photo = nullptr;
  CameraProjector projector;
  double scale_x = 1, scale_y = 1;  // camera pixels per map pixel

  // The world position of the middle of a pixel, `depth` along the axis.
  bool ToWorld(int column, int row, double depth, Vec3d* world) const {
    Vec3d ray;
    if (!projector.Unproject((column + 0.5) * scale_x, (row + 0.5) * scale_y, &ray) ||
        !(ray.z > 0)) {
      return false;
    }
    const Rigid3d& pose = photo->cam_from_world;
    *world = pose.InverseRotate(ray * (depth / ray.z) - pose.translation);
    return true;
  }

  // The map's pixel that shows a point, and the point's depth.
  bool ToPixel(const Vec3d& world, int* column, int* row, double* depth) const {
    const Vec3d p = photo->cam_from_world.Apply(world);
    double x, y;
    if (!projector.Project(p, &x, &y)) return false;
    x /= scale_x;
    y /= scale_y;
    if (!(x >= 0 && y >= 0 && x < size.width && y < size.height)) return false;
    *column = static_cast<int>(x);
    *row = static_cast<int>(y);
    *depth = p.z;
    return true;
  }
};

// The maps of one view while they are needed.
struct ViewMaps {
  FloatMap depths;
  std::optional<FloatMap> normal;

  bool DepthAt(int column, int row, double* depth) const {
    const float d = depths.At(column, row);
    *depth = d;
    return d > 0 && std::isfinite(d);
  }
  // In world axes, zero where it is not known.
  Vec3d NormalAt(const View& view, int column, int row) const {
    if (!normal) return {};
    const Vec3d n{normal->At(column, row, 0), normal->At(column, row, 1),
                  normal->At(column, row, 2)};
    const double length = Length(n);
    if (!(length > 0.5 && length < 2)) return {};
    return view.photo->cam_from_world.InverseRotate(n / length);
  }
};

// Keeps the maps that were used last, within a bound.
class MapCache {
 public:
  MapCache(const std::vector<View>& views, std::uint64_t bound) : views_(views), bound_(bound) {}

  // Throws InputError.
  std::shared_ptr<const ViewMaps> Get(std::size_t view) {
    const auto known = entries_.find(view);
    if (known != entries_.end()) {
      recent_.splice(recent_.begin(), recent_, known->second.place);
      return known->second.maps;
    }
    const View& v = views_[view];
    auto maps = std::make_shared<ViewMaps>();
    maps->depths = ReadFloatMap(v.depth_path, 1);
    if (!v.normal_path.empty()) {
      FloatMap normal = ReadFloatMap(v.normal_path, 3);
      if (normal.width == v.size.width && normal.height == v.size.height) {
        maps->normal = std::move(normal);
      }
    }
    const std::uint64_t bytes = Bytes(v);
    while (!recent_.empty() && held_ + bytes > bound_) {
      held_ -= Bytes(views_[recent_.back()]);
      entries_.erase(recent_.back());
      recent_.pop_back();
    }
    recent_.push_front(view);
    entries_[view] = {maps, recent_.begin()};
    held_ += bytes;
    return maps;
  }

  static std::uint64_t Bytes(const View& view) {
    return view.size.pixels() * (view.normal_path.empty() ? 4 : 16);
  }

 private:
  struct Entry {
    std::shared_ptr<const ViewMaps> maps;
    std::list<std::size_t>::iterator place;
  };
  const std::vector<View>& views_;
  std::uint64_t bound_, held_ = 0;
  std::list<std::size_t> recent_;  // the latest first
  std::map<std::size_t, Entry> entries_;
};

struct Used {
  std::size_t view = 0;
  std::size_t pixel = 0;
};

struct Candidate {
  Vec3d position{};
  Vec3f normal{};
  std::size_t pixel = 0;           // of the reference map
  std::size_t begin = 0, end = 0;  // of the pixels that agree, in Block::used
};

struct Block {
  std::vector<Candidate> candidates;
  std::vector<Used> used;
};

std::uint64_t Mixed(std::uint64_t x) {  // splitmix64
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

// Points as they come, halved whenever they are too many: a point stays or goes by a number of its
// own, so that what stays is spread evenly.
class Collector {
 public:
  Collector(std::uint64_t limit, bool normals) : limit_(limit), normals_(normals) {
    points_.photo_begin.push_back(0);
  }

  void Add(const Candidate& candidate, Rgb8 color, std::vector<std::uint32_t>* photos,
           std::uint64_t id) {
    const std::uint64_t number = Mixed(id);
    if (limit_ > 0 && number > most_) return;
    points_.position.push_back(candidate.position);
    points_.color.push_back(color);
    if (normals_) points_.normal.push_back(candidate.normal);
    std::sort(photos->begin(), photos->end());
    points_.photo_idx.insert(points_.photo_idx.end(), photos->begin(), photos->end());
    points_.photo_begin.push_back(points_.photo_idx.size());
    if (limit_ == 0) return;
    numbers_.push_back(number);
    if (points_.size() > limit_) Halve();
  }

  SurveyPoints Take() { return std::move(points_); }

 private:
  void Halve() {
    most_ /= 2;
    std::vector<std::uint32_t> kept;
    std::vector<std::uint64_t> numbers;
    for (std::size_t i = 0; i < numbers_.size(); ++i) {
      if (numbers_[i] > most_) continue;
      kept.push_back(static_cast<std::uint32_t>(i));
      numbers.push_back(numbers_[i]);
    }
    Keep(kept, &points_);
    numbers_ = std::move(numbers);
  }

  std::uint64_t limit_, most_ = UINT64_MAX;
  bool normals_;
  SurveyPoints points_;
  std::vector<std::uint64_t> numbers_;
};

std::vector<View> FindViews(const FusionOptions& options, Survey* survey, const Control& control) {
  std::vector<View> views;
  std::uint64_t unreadable = 0;
  std::string example;
  for (std::size_t i = 0; i < survey->photographs.size(); ++i) {
    control.ThrowIfStopped();
    const Photograph& photo = survey->photographs[i];
    const SurveyCamera& camera = survey->cameras[photo.camera_idx];
    const std::string path = FindMap(options.stereo_folder + "/depth_maps", photo.name);
    if (path.empty()) continue;
    View view{static_cast<std::uint32_t>(i), path, {}, {}, &photo, CameraProjector(camera)};
    try {
      view.size = ReadMapHeader(path);
      if (view.size.channels != 1) throw InputError(path, "", "has not one channel");
      view.scale_x = static_cast<double>(camera.width) / view.size.width;
      view.scale_y = static_cast<double>(camera.height) / view.size.height;
      // Sides are rounded to whole pixels when a map is made smaller.
      const double slack = 0.005 + 1.0 / std::min(view.size.width, view.size.height);
      if (std::abs(view.scale_x / view.scale_y - 1) > slack) {
        throw InputError(path, "", "is of another shape than its camera's pictures");
      }
    } catch (const InputError& error) {
      if (unreadable++ == 0) example = error.what();
      continue;
    }
    view.normal_path = FindMap(options.stereo_folder + "/normal_maps", photo.name);
    if (!view.normal_path.empty()) {
      try {
        const MapHeader normal = ReadMapHeader(view.normal_path);
        if (normal.channels != 3 || normal.width != view.size.width ||
            normal.height != view.size.height) {
          throw InputError(view.normal_path, "", "does not fit the depth map");
        }
      } catch (const InputError& error) {
        if (unreadable++ == 0) example = error.what();
        view.normal_path.clear();
      }
    }
    views.push_back(std::move(view));
  }
  if (unreadable > 0) {
    survey->warnings.push_back(std::to_string(unreadable) + " depth or normal maps are left out: " +
                               example + (unreadable > 1 ? " (and others)" : ""));
  }
  return views;
}

// The other views that show most of what the reference shows, the nearer camera first among equals.
std::vector<std::size_t> NeighborsOf(const std::vector<View>& views, std::size_t reference,
                                     const ViewMaps& maps) {
  const View& view = views[reference];
  std::vector<Vec3d> sample;
  for (int r = 0; r < kSampleSide; ++r) {
    for (int c = 0; c < kSampleSide; ++c) {
      const int column = (2 * c + 1) * view.size.width / (2 * kSampleSide);
      const int row = (2 * r + 1) * view.size.height / (2 * kSampleSide);
      double depth;
      Vec3d world;
      if (maps.DepthAt(column, row, &depth) && view.ToWorld(column, row, depth, &world)) {
        sample.push_back(world);
      }
    }
  }
  struct Rank {
    int shown;
    double distance;
    std::size_t view;
  };
  std::vector<Rank> ranks;
  const Vec3d center = view.photo->cam_from_world.Center();
  for (std::size_t j = 0; j < views.size(); ++j) {
    if (j == reference) continue;
    int shown = 0, column, row;
    double depth;
    for (const Vec3d& p : sample) shown += views[j].ToPixel(p, &column, &row, &depth);
    if (shown > 0) {
      ranks.push_back({shown, Length(views[j].photo->cam_from_world.Center() - center), j});
    }
  }
  std::sort(ranks.begin(), ranks.end(), [](const Rank& a, const Rank& b) {
    return std::tie(b.shown, a.distance, a.view) < std::tie(a.shown, b.distance, b.view);
  });
  std::vector<std::size_t> neighbors;
  for (std::size_t k = 0; k < std::min(ranks.size(), kMostNeighbors); ++k) {
    neighbors.push_back(ranks[k].view);
  }
  return neighbors;
}

struct Neighbor {
  std::size_t view = 0;
  std::shared_ptr<const ViewMaps> maps;
};

// What the maps say of one row of the reference, without the pixels that are used up.
void FuseRow(const FusionOptions& options, const std::vector<View>& views, std::size_t reference,
             const ViewMaps& maps, const std::vector<Neighbor>& neighbors,
             const std::vector<bool>& used, int row, Block* block) {
  const View& view = views[reference];
  const std::size_t needed =
      std::min(neighbors.size(), static_cast<std::size_t>(std::max(0, options.agreeing)));
  const double least_cosine = std::cos(options.normal_tolerance_deg * std::numbers::pi / 180);
  for (int column = 0; column < view.size.width; ++column) {
    const std::size_t pixel = static_cast<std::size_t>(row) * view.size.width + column;
    double depth;
    Vec3d point;
    if (used[pixel] || !maps.DepthAt(column, row, &depth) ||
        !view.ToWorld(column, row, depth, &point)) {
      continue;
    }
    const Vec3d normal = maps.NormalAt(view, column, row);
    Candidate candidate;
    candidate.pixel = pixel;
    candidate.begin = block->used.size();
    Vec3d sum = point, normal_sum = normal;
    for (const Neighbor& neighbor : neighbors) {
      const View& other = views[neighbor.view];
      int c, r;
      double expected, found;
      if (!other.ToPixel(point, &c, &r, &expected) || !neighbor.maps->DepthAt(c, r, &found) ||
          std::abs(found - expected) > options.depth_tolerance * expected) {
        continue;
      }
      const Vec3d other_normal = neighbor.maps->NormalAt(other, c, r);
      if (Length(normal) > 0 && Length(other_normal) > 0 &&
          Dot(normal, other_normal) < least_cosine) {
        continue;
      }
      Vec3d other_point;
      if (!other.ToWorld(c, r, found, &other_point)) continue;
      sum += other_point;
      normal_sum += other_normal;
      block->used.push_back({neighbor.view, static_cast<std::size_t>(r) * other.size.width + c});
    }
    candidate.end = block->used.size();
    const std::size_t agreeing = candidate.end - candidate.begin;
    if (agreeing < needed) {
      block->used.resize(candidate.begin);
      continue;
    }
    candidate.position = sum / static_cast<double>(agreeing + 1);
    candidate.normal = Normalized(normal_sum, Vec3d{}).cast<float>();
    if (IsFinite(candidate.position)) block->candidates.push_back(candidate);
  }
}

// A photograph at about the resolution of its depth map.
class MapColors {
 public:
  MapColors(const View& view, std::uint64_t* unreadable) : view_(view) {
    if (view.photo->path.empty()) return;
    try {
      image_ = ReadPhoto(view.photo->path, std::max(view.size.width, view.size.height));
    } catch (const InputError&) {
      ++*unreadable;
    }
  }

  Rgb8 At(std::size_t pixel) const {
    if (image_.pixels.empty()) return {128, 128, 128};
    const auto width = static_cast<std::size_t>(view_.size.width);
    const auto place = [](std::size_t i, int from, int to) {
      return std::min(to - 1, static_cast<int>((static_cast<double>(i) + 0.5) * to / from));
    };
    const int x = place(pixel % width, view_.size.width, image_.width);
    const int y = place(pixel / width, view_.size.height, image_.height);
    return image_.pixels[static_cast<std::size_t>(y) * image_.width + x];
  }

 private:
  const View& view_;
  PhotoImage image_;
};

std::uint64_t CheckFusionMemory(const FusionOptions& options, const std::vector<View>& views) {
  std::uint64_t pixels = 0, largest = 0;
  for (const View& view : views) {
    pixels += view.size.pixels();
    largest = std::max(largest, MapCache::Bytes(view));
  }
  // A reference and its neighbours at once; a bit for every pixel; and, where maps agree, a point
  // of about 60 bytes for every third pixel (arrays may hold twice that while they grow).
  const std::uint64_t at_once = largest * std::min<std::uint64_t>(views.size(), kMostNeighbors + 1);
  std::uint64_t points = views.size() < 3 ? pixels : pixels / 3;
  if (options.decimate_to > 0) points = std::min(points, options.decimate_to);
  CheckMemory(options.stereo_folder, at_once + pixels / 8 + points * 120,
              options.memory_limit_bytes);
  return at_once;
}

}  // namespace

void FuseDepthMaps(const FusionOptions& options, Survey* survey, const Control& control) {
  const std::vector<View> views = FindViews(options, survey, control);
  if (views.empty()) {
    throw InputError(options.stereo_folder + "/depth_maps", "",
                     "holds no depth map of the model's photographs",
                     "run COLMAP's patch_match_stereo, or import the sparse model");
  }
  const std::uint64_t at_once = CheckFusionMemory(options, views);
  MapCache cache(views, std::max<std::uint64_t>(at_once, 512u << 20));
  const bool normals =
      std::any_of(views.begin(), views.end(), [](const View& v) { return !v.normal_path.empty(); });
  std::vector<std::vector<bool>> used(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) used[i].resize(views[i].size.pixels());
  Collector collector(options.decimate_to, normals);
  std::uint64_t no_color = 0;
  std::vector<std::uint32_t> photos;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const View& view = views[i];
    const double done = static_cast<double>(i) / static_cast<double>(views.size());
    control.Report("joining depth maps", done);
    const std::shared_ptr<const ViewMaps> maps = cache.Get(i);
    std::vector<Neighbor> neighbors;
    for (const std::size_t j : NeighborsOf(views, i, *maps)) neighbors.push_back({j, cache.Get(j)});
    const auto rows = static_cast<std::size_t>(view.size.height);
    std::vector<Block> blocks((rows + kRowsAtOnce - 1) / kRowsAtOnce);
    ParallelBlocks(
        rows, kRowsAtOnce,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t row = begin; row < end; ++row) {
            FuseRow(options, views, i, *maps, neighbors, used[i], static_cast<int>(row),
                    &blocks[begin / kRowsAtOnce]);
          }
        },
        control);
    const MapColors colors(view, &no_color);
    for (const Block& block : blocks) {
      for (const Candidate& candidate : block.candidates) {
        photos.assign(1, view.photo_idx);
        for (std::size_t k = candidate.begin; k < candidate.end; ++k) {
          const Used& u = block.used[k];
          used[u.view][u.pixel] = true;
          photos.push_back(views[u.view].photo_idx);
        }
        collector.Add(candidate, colors.At(candidate.pixel), &photos,
                      (static_cast<std::uint64_t>(i) << 40) + candidate.pixel);
      }
    }
  }
  survey->points = collector.Take();
  survey->dense_pixel_offset = 0;
  if (no_color > 0) {
    survey->warnings.push_back(std::to_string(no_color) +
                               " photographs could not be read: the points of their depth maps "
                               "are grey");
  }
  control.Report("depth maps joined", 1.0);
}

}  // namespace sherd
