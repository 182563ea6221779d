#include "reconstruction/photo_colors.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "metaball/error.h"
#include "metaball/photo/filter.h"
#include "metaball/stopwatch.h"
#include "reconstruction/parallel.h"
#include "reconstruction/photo_exposure.h"
#include "reconstruction/photo_set.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr std::size_t kLookupsAtOnce = std::size_t{1} << 20;
constexpr std::size_t kExposurePlaces = 20000;
constexpr double kLeastCosine = 0.1;
constexpr float kDisagreement = 0.2f;  // natural logarithm of the luma: half the weight

struct Sample {
  Vec3f color{};     // linear, as the photograph shows it
  float weight = 0;  // 0: the photograph does not see the place or cannot be read
};

float LogLuma(const Vec3f& c) {
  return std::log(0.004f + 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z);
}

// The samples' mean, each weighted once more by how near it is to their weighted median.
Vec3f Consensus(const Sample* samples, std::size_t n, float* total) {
  constexpr std::size_t kMost = 64;
  std::pair<float, float> luma[kMost];  // and weight
  std::size_t count = 0;
  *total = 0;
  for (std::size_t i = 0; i < n && count < kMost; ++i) {
    if (!(samples[i].weight > 0)) continue;
    luma[count++] = {LogLuma(samples[i].color), samples[i].weight};
    *total += samples[i].weight;
  }
  if (count == 0) return {};
  std::sort(luma, luma + count);
  float passed = 0, median = luma[count - 1].first;
  for (std::size_t i = 0; i < count; ++i) {
    passed += luma[i].second;
    if (passed >= *total / 2) {
      median = luma[i].first;
      break;
    }
  }
  Vec3f sum{};
  float weights = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!(samples[i].weight > 0)) continue;
    const float off = count > 2 ? (LogLuma(samples[i].color) - median) / kDisagreement : 0;
    const float weight = samples[i].weight / (1 + off * off * off * off);
    sum += samples[i].color * weight;
    weights += weight;
  }
  return sum * (1 / weights);
}

// What the samples and lookups leave of the budget, at least a quarter of it.
std::size_t BytesForPhotographs(const PhotoColorOptions& options, const Level& level) {
  const std::size_t budget = static_cast<std::size_t>(std::max(1, options.memory_mb)) << 20;
  const std::size_t own = level.photo_idx.size() * (sizeof(Sample) + 2 * sizeof(std::uint32_t)) +
                          kLookupsAtOnce * (sizeof(PhotoLookup) + sizeof(std::uint32_t) + 1);
  return std::max(budget / 4, budget - std::min(budget, own));
}

class Coloring {
 public:
  Coloring(const Survey& survey, const PhotoColorOptions& options, Level* level)
      : level_(*level),
        photos_(survey, BytesForPhotographs(options, *level), options.leave_out),
        samples_(level->photo_idx.size()) {}

  PhotoSet& photos() { return photos_; }

  // Fills samples_, photograph by photograph.
  void Look(const Control& control) {
    const std::size_t n = level_.cloud.size();
    std::vector<std::size_t> begin(photos_.size() + 1, 0);
    for (const std::uint16_t photo : level_.photo_idx) {
      if (photo < photos_.size()) ++begin[std::size_t{photo} + 1];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> entry(begin.back()), metaball(begin.back());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::uint32_t j = level_.photo_begin[i]; j < level_.photo_begin[i + 1]; ++j) {
        if (level_.photo_idx[j] >= photos_.size()) continue;
        const std::size_t at = next[level_.photo_idx[j]]++;
        entry[at] = j;
        metaball[at] = static_cast<std::uint32_t>(i);
      }
    }
    for (std::size_t first = 0; first < photos_.size();) {
      std::size_t last = first + 1;
      while (last < photos_.size() && begin[last + 1] - begin[first] <= kLookupsAtOnce) ++last;
      std::vector<PhotoLookup> lookups(begin[last] - begin[first]);
      std::vector<char> seen(lookups.size(), 0);
      ParallelBlocks(
          lookups.size(), kBlock,
          [&](std::size_t from, std::size_t to) {
            for (std::size_t k = from; k < to; ++k) {
              const std::size_t at = begin[first] + k;
              lookups[k].target = entry[at];
              lookups[k].photo = level_.photo_idx[entry[at]];
              seen[k] = Aim(metaball[at], &lookups[k]);
            }
          },
          control);
      std::size_t write = 0;
      for (std::size_t k = 0; k < lookups.size(); ++k) {
        if (seen[k]) lookups[write++] = lookups[k];
      }
      lookups.resize(write);
      photos_.Visit(
          lookups, "colouring the metaballs",
          [&](std::size_t k, const PhotoPyramid& pyramid) {
            samples_[lookups[k].target] = {SampleFootprint(pyramid, lookups[k]), lookups[k].weight};
          },
          control);
      first = last;
    }
  }

  void EvenOut() {
    const std::size_t n = level_.cloud.size();
    const std::size_t step = std::max<std::size_t>(1, n / kExposurePlaces);
    std::vector<ExposureSample> shared;
    std::uint32_t place = 0;
    for (std::size_t i = 0; i < n; i += step, ++place) {
      for (std::uint32_t j = level_.photo_begin[i]; j < level_.photo_begin[i + 1]; ++j) {
        if (samples_[j].weight > 0) {
          shared.push_back({place, level_.photo_idx[j], samples_[j].color});
        }
      }
    }
    const std::vector<Vec3f> gain = EvenExposures(shared, place, photos_.size());
    for (std::size_t j = 0; j < samples_.size(); ++j) {
      if (!(samples_[j].weight > 0)) continue;
      const Vec3f& g = gain[level_.photo_idx[j]];
      Vec3f& c = samples_[j].color;
      c = {c.x * g.x, c.y * g.y, c.z * g.z};
    }
  }

  void Color(PhotoColorStats* stats) {
    const std::size_t n = level_.cloud.size();
    if (level_.cloud.color.empty()) level_.cloud.color.assign(n, level_.cloud.uniform_color);
    std::vector<char> colored(n, 0);
    ParallelBlocks(n, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t first = level_.photo_begin[i];
        float total = 0;
        const Vec3f c =
            Consensus(samples_.data() + first, level_.photo_begin[i + 1] - first, &total);
        if (!(total > 0)) continue;
        level_.cloud.color[i] = Rgb8FromLinear(c);
        colored[i] = 1;
      }
    });
    stats->metaballs = n;
    stats->colored = static_cast<std::uint64_t>(std::count(colored.begin(), colored.end(), 1));
    stats->samples = static_cast<std::uint64_t>(std::count_if(
        samples_.begin(), samples_.end(), [](const Sample& s) { return s.weight > 0; }));
  }

 private:
  // Where the photograph shows the metaball; false where it does not.
  bool Aim(std::uint32_t i, PhotoLookup* lookup) const {
    const PhotoView* const view = photos_.View(lookup->photo);
    if (!view) return false;
    const Cloud& cloud = level_.cloud;
    const Vec3d center = cloud.frame.WorldFromLocal(cloud.center[i]);
    const Vec3d way = view->center() - center;
    const double distance = Length(way);
    if (!(distance > 0)) return false;
    const Vec3d direction = way * (1 / distance);
    const Vec3d normal =
        level_.normal.size() == cloud.size() ? level_.normal[i].cast<double>() : direction;
    const double cosine = Dot(direction, normal);
    if (!(cosine > kLeastCosine)) return false;
    // The part of the surface it stands for: a square in the tangent plane, of the local spacing
    // (radii follow it).
    const double side = level_.stats.radius_median > 0
                            ? level_.stats.spacing * cloud.RadiusOf(i) * cloud.frame.unit /
                                  level_.stats.radius_median
                            : cloud.RadiusOf(i) * cloud.frame.unit / 2;
    const Vec3d across = Perpendicular(normal) * side;
    const Vec3d along = Cross(normal, across);
    double x, y, ax, ay, bx, by;
    if (!view->Project(center, &x, &y) || !view->Project(center + across, &ax, &ay) ||
        !view->Project(center + along, &bx, &by)) {
      return false;
    }
    lookup->x = static_cast<float>(x);
    lookup->y = static_cast<float>(y);
    SetFootprint(ax - x, ay - y, bx - x, by - y, lookup);
    const double detail = std::min(1.0, double(lookup->width_px));
    lookup->weight =
        static_cast<float>(cosine * cosine * detail * detail * photos_.Unmasked(*lookup, center));
    return lookup->weight > 0;
  }

  Level& level_;
  PhotoSet photos_;
  std::vector<Sample> samples_;  // one for each entry of Level::photo_idx
};

}  // namespace

PhotoColorStats ColorFromPhotographs(const Survey& survey, const PhotoColorOptions& options,
                                     Level* level, const Control& control) {
  const Stopwatch watch;
  const std::size_t n = level->cloud.size();
  if (level->photo_begin.size() != n + 1) {
    throw InputError("", "",
                     "which photographs see the metaballs is not known, so they cannot give them "
                     "colours");
  }
  PhotoColorStats stats;
  Coloring coloring(survey, options, level);
  PhotoSet& photos = coloring.photos();
  photos.Prepare(std::vector<bool>(photos.size(), true), control);
  coloring.Look(control);
  if (options.even_exposures) coloring.EvenOut();
  if (photos.used() == 0 && !level->photo_idx.empty()) {
    throw InputError("", "",
                     "no photograph could be read" +
                         (photos.problems().empty() ? "" : ": " + photos.problems().front()),
                     "name the folder they lie in");
  }
  coloring.Color(&stats);
  stats.photos_used = photos.used();
  stats.photos_unreadable = photos.unreadable();
  stats.warnings = photos.Warnings();
  stats.seconds = watch.Seconds();
  return stats;
}

}  // namespace sherd
